#include "lab/recordings/sqlite_file.hpp"

#include <array>
#include <cstdio>
#include <cstring>

#include "lab/messages/input_error.hpp"

namespace kilvo::lab {
namespace {

// Steps of SQLite's machine for one row: a table costs a few dozen, a damaged tree that leads into itself any number.
constexpr int steps_between_looks = 100'000, most_looks = 20;

}  // namespace

/// How SQLite gets at the bytes: a file system of one file.
struct SqliteFile::Access {
  /// What SQLite holds of an open file. Its first member must be SQLite's own.
  struct Handle {
    sqlite3_file base;
    Access* access;
  };

  explicit Access(const FileBytes& bytes) : file(bytes) {
    std::snprintf(name, sizeof name, "kilvo-%p", static_cast<const void*>(this));
    const sqlite3_vfs* usual = sqlite3_vfs_find(nullptr);
    if (usual != nullptr) system = *usual;  // randomness, sleep and time are the system's
    system.pNext = nullptr;
    system.szOsFile = sizeof(Handle);
    system.mxPathname = 64;
    system.zName = name;
    system.pAppData = this;
    system.xOpen = open;
    system.xDelete = [](sqlite3_vfs*, const char*, int) { return SQLITE_READONLY; };
    system.xAccess = [](sqlite3_vfs*, const char*, int, int* there) { return *there = 0, SQLITE_OK; };
    system.xFullPathname = [](sqlite3_vfs*, const char* path, int size, char* out) {
      std::snprintf(out, static_cast<std::size_t>(size), "%s", path);
      return SQLITE_OK;
    };
    methods.iVersion = 1;
    methods.xClose = [](sqlite3_file*) { return SQLITE_OK; };
    methods.xRead = read;
    methods.xWrite = [](sqlite3_file*, const void*, int, sqlite3_int64) { return SQLITE_READONLY; };
    methods.xTruncate = [](sqlite3_file*, sqlite3_int64) { return SQLITE_READONLY; };
    methods.xSync = [](sqlite3_file*, int) { return SQLITE_OK; };
    methods.xFileSize = [](sqlite3_file* handle, sqlite3_int64* size) {
      *size = static_cast<sqlite3_int64>(reinterpret_cast<Handle*>(handle)->access->whole_pages());
      return SQLITE_OK;
    };
    methods.xLock = methods.xUnlock = [](sqlite3_file*, int) { return SQLITE_OK; };
    methods.xCheckReservedLock = [](sqlite3_file*, int* held) { return *held = 0, SQLITE_OK; };
    methods.xFileControl = [](sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; };
    methods.xSectorSize = [](sqlite3_file*) { return 0; };
    methods.xDeviceCharacteristics = [](sqlite3_file*) { return SQLITE_IOCAP_IMMUTABLE; };
    sqlite3_vfs_register(&system, 0);
  }
  ~Access() { sqlite3_vfs_unregister(&system); }

  static int open(sqlite3_vfs* vfs, const char* path, sqlite3_file* out, int flags, int* out_flags) {
    auto* handle = reinterpret_cast<Handle*>(out);
    handle->base.pMethods = nullptr;
    if (path == nullptr || (flags & SQLITE_OPEN_MAIN_DB) == 0) return SQLITE_CANTOPEN;
    handle->access = static_cast<Access*>(vfs->pAppData);
    handle->base.pMethods = &handle->access->methods;
    if (out_flags != nullptr) *out_flags = SQLITE_OPEN_READONLY | SQLITE_OPEN_MAIN_DB;
    return SQLITE_OK;
  }

  static int read(sqlite3_file* from, void* to, int count, sqlite3_int64 offset) {
    Access& access = *reinterpret_cast<Handle*>(from)->access;
    const auto size = static_cast<std::size_t>(count);
    access.last_offset = static_cast<std::uint64_t>(offset);
    const std::size_t got = access.file.read_at(access.last_offset, {static_cast<std::uint8_t*>(to), size});
    if (got == size) return SQLITE_OK;
    std::memset(static_cast<std::uint8_t*>(to) + got, 0, size - got);
    return SQLITE_IOERR_SHORT_READ;
  }

  /// The size of the file without a page that its end has cut: half a page would read as one with zeros in it.
  std::uint64_t whole_pages() const {
    std::array<std::uint8_t, 18> header{};
    if (file.read_at(0, header) < header.size()) return file.size();
    const std::uint64_t page = header[16] == 0 && header[17] == 1 ? 65536 : 256U * header[16] + header[17];
    return page < 512 ? file.size() : file.size() / page * page;
  }

  const FileBytes& file;
  std::uint64_t last_offset = 0;
  int looks = 0;
  char name[32] = "";
  sqlite3_vfs system{};
  sqlite3_io_methods methods{};
};

SqliteQuery::SqliteQuery(sqlite3* database, const std::string& text, int* looks) : looks_(looks) {
  sqlite3_stmt* statement = nullptr;
  state_ = sqlite3_prepare_v2(database, text.c_str(), -1, &statement, nullptr);
  statement_.reset(statement);
}

SqliteQuery& SqliteQuery::bind(int parameter, std::int64_t value) {
  sqlite3_bind_int64(statement_.get(), parameter, value);
  return *this;
}

int SqliteQuery::step() {
  *looks_ = 0;
  return state_ == SQLITE_OK ? sqlite3_step(statement_.get()) : state_;
}

std::string SqliteQuery::column_name(int column) const {
  const char* name = sqlite3_column_name(statement_.get(), column);
  return name == nullptr ? "" : name;
}

std::string SqliteQuery::text(int column) const { return std::string(as_text(blob(column))); }

Bytes SqliteQuery::blob(int column) const {
  const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes == nullptr || size <= 0 ? Bytes{} : Bytes(bytes, static_cast<std::size_t>(size));
}

SqliteFile::SqliteFile(const FileBytes& file) : access_(std::make_unique<Access>(file)) {
  const int state = sqlite3_open_v2("recording", &database_, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, access_->name);
  if (state == SQLITE_OK) {
    // What comes from the file is not to be believed, and a file shorter than it claims is to be read all the same.
    sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(database_, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
    sqlite3_exec(database_, "PRAGMA writable_schema=ON; PRAGMA cell_size_check=ON; PRAGMA temp_store=MEMORY; PRAGMA cache_size=-4096",
                 nullptr, nullptr, nullptr);
    sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, 1 << 28);
    sqlite3_progress_handler(
        database_, steps_between_looks, [](void* looks) { return ++*static_cast<int*>(looks) > most_looks ? 1 : 0; }, &access_->looks);
    SqliteQuery tables = query("SELECT count(*) FROM sqlite_master");
    if (tables.step() == SQLITE_ROW) return;
  }
  const std::string why = error();
  sqlite3_close_v2(database_);
  throw InputError(file.name() + ": not a readable SQLite database: " + why);
}

SqliteFile::~SqliteFile() { sqlite3_close_v2(database_); }

SqliteQuery SqliteFile::query(const std::string& text) const { return {database_, text, &access_->looks}; }

bool SqliteFile::has_table(const std::string& name) const {
  SqliteQuery tables = query("SELECT 1 FROM sqlite_master WHERE type='table' AND rootpage>0 AND name='" + name + "'");
  return tables.step() == SQLITE_ROW;
}

bool SqliteFile::has_column(const std::string& table, const std::string& column) const {
  SqliteQuery columns = query("SELECT * FROM " + table + " LIMIT 0");
  for (int i = 0; i < columns.columns(); ++i) {
    if (columns.column_name(i) == column) return true;
  }
  return false;
}

std::uint64_t SqliteFile::last_offset() const { return access_->last_offset; }

}  // namespace kilvo::lab
