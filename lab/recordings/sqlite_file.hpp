// SQLite reading a FileBytes: read-only, no locks, no journal, and the place of a fault is known.
#pragma once

#include <memory>
#include <sqlite3.h>
#include <string>

#include "lab/recordings/file_bytes.hpp"

namespace kilvo::lab {

/// A prepared statement; ends with its owner.
class SqliteQuery {
 public:
  /// `looks`: how often SQLite has asked, since the last step, whether it may go on.
  SqliteQuery(sqlite3* database, const std::string& text, int* looks);

  /// SQLITE_OK, or why the statement cannot be.
  int state() const { return state_; }
  SqliteQuery& bind(int parameter, std::int64_t value);
  /// SQLITE_ROW, SQLITE_DONE, or why not.
  int step();
  void reset() { sqlite3_reset(statement_.get()); }

  int columns() const { return sqlite3_column_count(statement_.get()); }
  std::string column_name(int column) const;
  std::int64_t number(int column) const { return sqlite3_column_int64(statement_.get(), column); }
  std::string text(int column) const;
  Bytes blob(int column) const;

 private:
  std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement_{nullptr, &sqlite3_finalize};
  int* looks_;
  int state_ = SQLITE_ERROR;
};

class SqliteFile {
 public:
  /// Throws InputError when the file is no SQLite database. `file` must outlive it.
  explicit SqliteFile(const FileBytes& file);
  ~SqliteFile();
  SqliteFile(const SqliteFile&) = delete;
  SqliteFile& operator=(const SqliteFile&) = delete;

  SqliteQuery query(const std::string& text) const;
  /// Only a real table: a view or a virtual table could compute for ever.
  bool has_table(const std::string& name) const;
  bool has_column(const std::string& table, const std::string& column) const;
  std::string error() const { return sqlite3_errmsg(database_); }
  /// Of the page that was read last.
  std::uint64_t last_offset() const;

 private:
  struct Access;

  std::unique_ptr<Access> access_;
  sqlite3* database_ = nullptr;
};

}  // namespace kilvo::lab
