#include "lab/recordings/rosbag1_layout.hpp"

#include <algorithm>

#include "lab/messages/input_error.hpp"
#include "lab/messages/ros_time.hpp"
#include "lab/recordings/rosbag1_resync.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t bag_index_entry_bytes = 12;  // time, offset in the chunk

/// Walks through the records of a file and notes what it meets.
class Walk {
 public:
  explicit Walk(const FileBytes& file) : file_(file), window_(file, window_bytes) {}

  BagLayout run() {
    std::uint64_t at = bag_magic.size();
    while (at < file_.size() && layout_.chunks.size() < most_chunks) {
      const auto record = record_at(at);
      const auto next = record ? take(*record, at) : lost(at, "no valid record begins here");
      if (!next) break;
      at = *next;
    }
    index_is_whole_ = false;  // a chunk at the very end of the file may have lost some of its index records
    finish_chunk();
    judge_end();
    return std::move(layout_);
  }

 private:
  struct Record {
    BagRecordHeader header;  // valid until the window moves
    std::uint64_t data_offset;
    std::uint64_t data_size;
  };

  std::optional<Record> record_at(std::uint64_t at) {
    ByteReader length(window_.view(at, 4));
    const std::size_t header_size = length.read<std::uint32_t>();
    if (!length.ok() || header_size > most_header_bytes) return std::nullopt;
    ByteReader reader(window_.view(at, header_size + 8));
    reader.skip(4);
    const auto header = parse_bag_header(reader.take(header_size));
    const std::uint64_t data_size = reader.read<std::uint32_t>();
    if (!reader.ok() || !header) return std::nullopt;
    return Record{*header, at + header_size + 8, data_size};
  }

  /// The offset to go on from, or nothing at the end of what can be read.
  std::optional<std::uint64_t> take(const Record& record, std::uint64_t at) {
    resynced_ = false;
    const bool whole = record.data_size <= file_.size() - record.data_offset;
    if (record.header.op == BagOp::chunk && is_chunk_header(record.header)) {
      begin_chunk(record, at);
      if (whole) return record.data_offset + record.data_size;
      layout_.chunks.back().doubtful_end = true;
      return lost(at, "the chunk is longer than the file");
    }
    if (!whole) return lost(at, "the record is longer than the file");
    bool sound = false;
    switch (record.header.op.value()) {
      case BagOp::index:
        sound = add_index(record);
        break;
      case BagOp::bag_header:
        sound = read_bag_header(record.header);
        break;
      case BagOp::connection:
        sound = add_connection(record);
        break;
      case BagOp::chunk_info:
        sound = add_chunk_info(record);
        break;
      default:
        break;
    }
    if (!sound) return lost(at, "a damaged record, or one of unknown kind");
    if (record.header.op != BagOp::index) finish_chunk();
    return record.data_offset + record.data_size;
  }

  /// Notes damage at `at` and looks for the next chunk. When a chunk's length is false, that chunk may lie within its claimed data.
  std::optional<std::uint64_t> lost(std::uint64_t at, const std::string& reason) {
    const bool in_chunk = open_ && layout_.chunks.back().offset == at;
    const bool search_in_chunk = open_ && !saw_index_ && !resynced_;
    const auto next = find_chunk(file_, search_in_chunk ? layout_.chunks.back().data_offset : at + 1);
    if (in_chunk && !next) {
      note({file_.size(), "the file ends in the middle of a chunk"});
    } else {
      note({at, reason});
    }
    index_is_whole_ = false;
    resynced_ = true;
    if (search_in_chunk && next) {
      BagChunk& chunk = layout_.chunks.back();
      chunk.doubtful_end = true;
      chunk.data_size = std::min(chunk.data_size, *next - chunk.data_offset);
    }
    return next;
  }

  void note(Damage damage) {
    if (layout_.damages.size() < most_damages) layout_.damages.push_back(std::move(damage));
  }

  void begin_chunk(const Record& record, std::uint64_t at) {
    finish_chunk();
    BagChunk chunk;
    chunk.offset = at;
    chunk.data_offset = record.data_offset;
    chunk.data_size = std::min(record.data_size, file_.size() - record.data_offset);
    chunk.inflated_size = *record.header.size;
    chunk.compression = record.header.compression;
    layout_.chunks.push_back(std::move(chunk));
    open_ = true;
    saw_index_ = false;
    index_is_whole_ = true;
    index_.clear();
  }

  /// What the index says of a chunk counts only when all of its index was read.
  void finish_chunk() {
    if (!open_) return;
    open_ = false;
    if (!index_is_whole_ || index_.empty()) return;
    BagChunk& chunk = layout_.chunks.back();
    chunk.indexed = true;
    chunk.first = index_.begin()->second.first;
    chunk.last = index_.begin()->second.last;
    for (const auto& [connection, times] : index_) {
      chunk.first = std::min(chunk.first, times.first);
      chunk.last = std::max(chunk.last, times.last);
      if (layout_.times.size() >= most_connections && !layout_.times.contains(connection)) continue;
      TimesSummary& total = layout_.times[connection];
      chunk.new_connections |= total.count == 0;
      total.append(times);
    }
  }

  bool add_index(const Record& record) {
    saw_index_ = true;
    const auto& header = record.header;
    if (!open_ || !header.connection || !header.count || index_.size() >= most_connections) return false;
    if (record.data_size != std::uint64_t{*header.count} * bag_index_entry_bytes) return false;
    const std::uint32_t connection = *header.connection;
    std::uint64_t left = record.data_size, at = record.data_offset;
    while (left > 0) {
      const auto piece =
          static_cast<std::size_t>(std::min<std::uint64_t>(left, window_bytes / bag_index_entry_bytes * bag_index_entry_bytes));
      ByteReader entries(window_.view(at, piece));
      if (entries.remaining() < piece) return false;
      TimesSummary& times = index_[connection];
      while (entries.remaining() > 0) {
        times.add(read_ros_time(entries));
        entries.skip(4);
      }
      at += piece;
      left -= piece;
    }
    return true;
  }

  bool read_bag_header(const BagRecordHeader& header) {
    if (!header.index_pos) return false;
    if (!header.encryptor.empty()) throw InputError(file_.name() + ": the bag is encrypted (" + std::string(header.encryptor) + ")");
    has_header_ = true;
    index_pos_ = *header.index_pos;
    chunk_count_ = header.chunk_count.value_or(0);
    return true;
  }

  bool add_chunk_info(const Record& record) {
    ++chunk_infos_;
    return record.header.count && record.data_size == std::uint64_t{*record.header.count} * 8;
  }

  bool add_connection(const Record& record) {
    if (record.data_size > most_connection_bytes) return false;
    const std::string topic(record.header.topic);  // the window is about to move
    BagRecordHeader header = record.header;
    header.topic = topic;
    auto connection = parse_connection(header, window_.view(record.data_offset, static_cast<std::size_t>(record.data_size)));
    if (!connection) return false;
    if (layout_.footer.size() < most_connections) layout_.footer.emplace(connection->id, std::move(*connection));
    return true;
  }

  /// A file that was cut between two records looks sound until here.
  void judge_end() {
    if (!layout_.damages.empty()) return;
    if (!has_header_)
      layout_.damages.push_back({bag_magic.size(), "the bag's header is missing"});
    else if (index_pos_ == 0)
      layout_.damages.push_back({file_.size(), "the bag was never closed"});
    else if (index_pos_ > file_.size() || chunk_infos_ < chunk_count_)
      layout_.damages.push_back({file_.size(), "the file ends before its index"});
  }

  const FileBytes& file_;
  FileWindow window_;
  BagLayout layout_;
  bool open_ = false;  // the last record was a chunk or one of its index records
  bool saw_index_ = false;
  bool index_is_whole_ = true;
  bool resynced_ = false;                        // the next record was found by its look, and must not be found again if it proves false
  std::map<std::uint32_t, TimesSummary> index_;  // of the last chunk
  bool has_header_ = false;
  std::uint64_t index_pos_ = 0;
  std::uint64_t chunk_count_ = 0, chunk_infos_ = 0;
};

}  // namespace

BagLayout read_bag_layout(const FileBytes& file) {
  if (file.size() == 0) throw InputError(file.name() + ": the file is empty");
  std::vector<std::uint8_t> begin(bag_magic.size());
  begin.resize(file.read_at(0, begin));
  const std::string_view text = as_text(begin);
  if (text != bag_magic) {
    if (text.starts_with("#ROSBAG V"))
      throw InputError(file.name() + ": only ROS bags of version 2.0 are read (rosbag fix converts older ones)");
    throw InputError(file.name() + ": not a ROS 1 bag");
  }
  return Walk(file).run();
}

}  // namespace kilvo::lab
