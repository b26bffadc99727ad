#include "lab/recordings/db3_reader.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/inflate.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t rows_of_a_block = 4096;
constexpr std::uint64_t bytes_of_a_block = 8 << 20;
constexpr std::size_t most_blocks = 1'000'000;
constexpr std::uint64_t least_row_bytes = 4;  // a row that a sound file holds has more
constexpr int most_probes = 48;               // for the next good row behind a bad page
constexpr std::size_t most_bad_places = 1000;

/// Goes through the rows in the order of their ids, over pages that cannot be read: (id, topic, time, size of the data).
class RowWalk {
 public:
  RowWalk(const SqliteFile& database, std::int64_t after, std::int64_t last)
      : database_(database),
        query_(database.query(
            "SELECT rowid, topic_id, timestamp, length(data) FROM messages WHERE rowid > ?1 AND rowid <= ?2 ORDER BY rowid")),
        after_(after),
        last_(last) {
    restart();
  }

  bool next() {
    for (int probe = 0; probe < most_probes && bad_places_ < most_bad_places && !done_;) {
      const int state = query_.step();
      if (state == SQLITE_ROW && query_.number(0) > after_) {
        after_ = query_.number(0);
        return true;
      }
      done_ = state == SQLITE_DONE;  // one more step would begin again
      if (done_) return false;
      if (probe++ == 0) {
        ++bad_places_;
        if (!damage_)
          damage_ = Damage{database_.last_offset(), "sqlite: " + (state == SQLITE_ROW ? "rows out of order" : database_.error())};
      }
      // The next row, or the one after, or farther and farther on, until a page is good.
      const std::int64_t step = std::int64_t{1} << std::max(probe - 8, 0);
      if (after_ > last_ - step) return false;
      after_ += step;
      restart();
    }
    return false;
  }

  std::int64_t id() const { return query_.number(0); }
  std::int64_t topic() const { return query_.number(1); }
  Time time() const { return recorded_time(query_.number(2)); }
  std::uint64_t size() const { return static_cast<std::uint64_t>(std::max<std::int64_t>(query_.number(3), 0)); }
  const std::optional<Damage>& damage() const { return damage_; }

 private:
  void restart() {
    query_.reset();
    query_.bind(1, after_).bind(2, last_);
  }

  const SqliteFile& database_;
  SqliteQuery query_;
  std::int64_t after_, last_;
  std::size_t bad_places_ = 0;
  bool done_ = false;
  std::optional<Damage> damage_;
};

constexpr std::int64_t no_id = std::numeric_limits<std::int64_t>::min(), any_id = std::numeric_limits<std::int64_t>::max() - 1;

/// The messages in rows that follow each other.
class RowReader final : public ChunkReader {
 public:
  RowReader(const SqliteFile& database, std::int64_t first, std::int64_t last)
      : database_(database), rows_(database, first - 1, last), data_(database.query("SELECT data FROM messages WHERE rowid = ?1")) {}

  std::optional<MessageEntry> scan(const std::function<void(const Channel&)>& = {}) override {
    if (!rows_.next()) {
      if (!damage_) damage_ = rows_.damage();
      return std::nullopt;
    }
    const auto size = static_cast<std::uint32_t>(std::min<std::uint64_t>(rows_.size(), most_message_bytes + 1));
    return MessageEntry{rows_.time(), static_cast<std::uint64_t>(rows_.id()), size, static_cast<std::uint32_t>(rows_.topic())};
  }

  std::optional<Bytes> message(const MessageEntry& entry) override {
    data_.reset();
    data_.bind(1, static_cast<std::int64_t>(entry.offset));
    if (data_.step() != SQLITE_ROW) return spoilt("sqlite: " + database_.error());
    const Bytes bytes = data_.blob(0);
    if (bytes.size() != entry.size) return spoilt("sqlite: a message cannot be read: " + database_.error());
    if (!is_zstd(bytes)) return bytes;
    Inflated inflated = inflate_zstd(bytes, most_message_bytes);
    if (!inflated.fault.empty()) return spoilt("a message: " + inflated.fault);
    inflated_ = std::move(inflated.bytes);
    return Bytes(inflated_);
  }

  const std::optional<Damage>& damage() const override { return damage_; }
  std::size_t held() const override { return inflated_.capacity(); }

 private:
  std::optional<Bytes> spoilt(const std::string& why) {
    damage_ = Damage{database_.last_offset(), why};
    return std::nullopt;
  }

  const SqliteFile& database_;
  RowWalk rows_;
  SqliteQuery data_;
  std::vector<std::uint8_t> inflated_;
  std::optional<Damage> damage_;
};

}  // namespace

Db3Reader::Db3Reader(FileBytes bytes) : ChunkedReader(std::move(bytes)), database_(std::make_unique<SqliteFile>(file())) {
  for (const char* table : {"topics", "messages"}) {
    if (!database_->has_table(table)) throw InputError(file().name() + ": a SQLite database, but not of rosbag2: no table " + table);
  }
  Found found;
  topics_ = read_topics();
  found.before = topics_;
  read_rows(found);
  judge_end(found);
  start(std::move(found));
}

Db3Reader::~Db3Reader() = default;

std::map<std::uint32_t, Channel> Db3Reader::read_topics() {
  std::map<std::string, std::string> definitions;
  if (database_->has_table("message_definitions") && database_->has_column("message_definitions", "encoded_message_definition")) {
    SqliteQuery rows = database_->query("SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding='ros2msg'");
    while (rows.step() == SQLITE_ROW && definitions.size() < most_connections) {
      if (rows.blob(1).size() <= most_definition_bytes) definitions.emplace(plain_type_name(rows.text(0)), rows.text(1));
    }
  }
  std::map<std::uint32_t, Channel> topics;
  SqliteQuery rows = database_->query("SELECT id, name, type, serialization_format FROM topics");
  while (rows.step() == SQLITE_ROW && topics.size() < most_connections) {
    Channel channel;
    channel.id = static_cast<std::uint32_t>(rows.number(0));
    channel.topic = rows.text(1);
    channel.type = plain_type_name(rows.text(2));
    channel.encoding = rows.text(3) == "cdr" ? Encoding::cdr : rows.text(3) == "ros1" ? Encoding::ros1 : Encoding::other;
    const auto definition = definitions.find(channel.type);
    if (definition != definitions.end()) channel.definition = definition->second;
    topics.emplace(channel.id, std::move(channel));
  }
  return topics;
}

/// Reads the head of every row: its data lie on pages of their own where they are long.
void Db3Reader::read_rows(Found& found) {
  RowWalk rows(*database_, no_id, any_id);
  std::uint64_t left = file_size() / least_row_bytes;
  while (left-- > 0 && blocks_.size() < most_blocks && rows.next()) {
    if (blocks_.empty() || blocks_.back().times.count >= rows_of_a_block || blocks_.back().bytes >= bytes_of_a_block)
      blocks_.push_back({rows.id(), rows.id(), {}, 0});
    Block& block = blocks_.back();
    block.last = rows.id();
    block.times.add(rows.time());
    block.bytes += rows.size();
    const auto topic = static_cast<std::uint32_t>(rows.topic());
    if (found.times.size() < most_connections || found.times.contains(topic)) found.times[topic].add(rows.time());
  }
  for (const Block& block : blocks_) found.spans.push_back({block.times.first, block.times.last, block.bytes, 0, true, false});
  if (rows.damage()) found.damages.push_back(*rows.damage());
  if (!blocks_.empty()) {
    SqliteQuery first = database_->query("SELECT data FROM messages WHERE rowid = ?1");
    message_compression_ = first.bind(1, blocks_.front().first).step() == SQLITE_ROW && is_zstd(first.blob(0));
  }
}

/// The header counts the pages.
void Db3Reader::judge_end(Found& found) const {
  std::array<std::uint8_t, 100> header{};
  if (!found.damages.empty() || file().read_at(0, header) < header.size()) return;
  const auto big_endian = [&](std::size_t at, int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) value = value << 8 | header[at + static_cast<std::size_t>(i)];
    return value;
  };
  const std::uint64_t page = big_endian(16, 2) == 1 ? 65536 : big_endian(16, 2);
  const bool counted = big_endian(24, 4) == big_endian(92, 4);
  if (counted && big_endian(28, 4) * page > file_size()) found.damages.push_back({file_size(), "the file ends before its last page"});
}

StorageSummary Db3Reader::storage() const { return {"SQLite (rosbag2)", message_compression_ ? "zstd by message" : "none", 0}; }

std::unique_ptr<ChunkReader> Db3Reader::open(std::size_t span) {
  return std::make_unique<RowReader>(*database_, blocks_[span].first, blocks_[span].last);
}

}  // namespace kilvo::lab
