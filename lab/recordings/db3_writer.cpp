#include "lab/recordings/db3_writer.hpp"

#include <algorithm>
#include <sqlite3.h>

#include "lab/recordings/deflate.hpp"

namespace kilvo::lab {
namespace {

constexpr const char* tables =
    "PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF;"
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL);"
    "INSERT INTO schema VALUES(4,'jazzy');"
    "CREATE TABLE metadata(id INTEGER PRIMARY KEY,metadata_version INTEGER NOT NULL,metadata TEXT NOT NULL);"
    "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,"
    "offered_qos_profiles TEXT NOT NULL,type_description_hash TEXT NOT NULL);"
    "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY,topic_type TEXT NOT NULL,encoding TEXT NOT NULL,"
    "encoded_message_definition TEXT NOT NULL,type_description_hash TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
    "BEGIN";

using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

void bind_text(sqlite3_stmt* statement, int at, const std::string& text) {
  sqlite3_bind_text(statement, at, text.c_str(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
}

}  // namespace

struct Db3Writer::Database {
  sqlite3* handle = nullptr;
  Statement insert{nullptr, &sqlite3_finalize};

  ~Database() {
    insert.reset();
    sqlite3_close_v2(handle);
  }
  Statement prepare(const char* text) const {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(handle, text, -1, &statement, nullptr);
    return {statement, &sqlite3_finalize};
  }
};

Db3Writer::Db3Writer(const std::filesystem::path& path, bool compress)
    : database_(std::make_unique<Database>()), name_(path.string()), compress_(compress) {
  std::error_code error;
  std::filesystem::remove(path, error);
  const bool made = sqlite3_open(path.c_str(), &database_->handle) == SQLITE_OK &&
                    sqlite3_exec(database_->handle, tables, nullptr, nullptr, nullptr) == SQLITE_OK;
  if (!made) throw OutputError(name_ + ": cannot be written: " + sqlite3_errmsg(database_->handle));
  database_->insert = database_->prepare("INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)");
}

Db3Writer::~Db3Writer() {
  try {
    close();
  } catch (const OutputError&) {
    // For those who call close().
  }
}

std::uint32_t Db3Writer::add_channel(const Channel& channel) {
  if (channel.encoding != Encoding::cdr) throw OutputError(name_ + ": rosbag2 holds messages in CDR only");
  const std::string type = ros2_type_name(channel.type);
  const Statement topic = database_->prepare("INSERT INTO topics VALUES(?1, ?2, ?3, 'cdr', '', '')");
  sqlite3_bind_int64(topic.get(), 1, ++topics_);
  bind_text(topic.get(), 2, channel.topic);
  bind_text(topic.get(), 3, type);
  bool done = sqlite3_step(topic.get()) == SQLITE_DONE;
  if (!channel.definition.empty() && std::ranges::find(defined_, type) == defined_.end()) {
    const Statement definition = database_->prepare(
        "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition, type_description_hash) VALUES(?1, 'ros2msg', "
        "?2, '')");
    bind_text(definition.get(), 1, type);
    bind_text(definition.get(), 2, channel.definition);
    done = done && sqlite3_step(definition.get()) == SQLITE_DONE;
    defined_.push_back(type);
  }
  if (!done) throw OutputError(name_ + ": cannot be written: " + sqlite3_errmsg(database_->handle));
  return topics_;
}

void Db3Writer::write(std::uint32_t channel, Time recorded, Bytes message) {
  std::vector<std::uint8_t> frame;
  if (compress_) {
    frame = deflate_zstd(message);
    message = frame;
  }
  sqlite3_stmt* insert = database_->insert.get();
  sqlite3_reset(insert);
  sqlite3_bind_int64(insert, 1, channel);
  sqlite3_bind_int64(insert, 2, to_ns(recorded));
  sqlite3_bind_blob64(insert, 3, message.data(), message.size(), SQLITE_STATIC);
  if (sqlite3_step(insert) != SQLITE_DONE) throw OutputError(name_ + ": cannot be written: " + sqlite3_errmsg(database_->handle));
}

void Db3Writer::flush() {
  if (sqlite3_exec(database_->handle, "COMMIT; BEGIN", nullptr, nullptr, nullptr) != SQLITE_OK)
    throw OutputError(name_ + ": cannot be written: " + sqlite3_errmsg(database_->handle));
}

void Db3Writer::close() {
  if (database_->handle == nullptr) return;
  database_->insert.reset();
  const bool done = sqlite3_exec(database_->handle, "COMMIT", nullptr, nullptr, nullptr) == SQLITE_OK;
  const std::string why = sqlite3_errmsg(database_->handle);
  sqlite3_close_v2(database_->handle);
  database_->handle = nullptr;
  if (!done) throw OutputError(name_ + ": cannot be written: " + why);
}

}  // namespace kilvo::lab
