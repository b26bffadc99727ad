#include "lab/recordings/mcap_layout.hpp"

#include <algorithm>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/mcap_resync.hpp"

namespace kilvo::lab {
namespace {

constexpr std::uint64_t most_region_bytes = 1 << 20;  // records outside of chunks are read so much at a time
constexpr std::size_t most_mcap_chunks = 1'000'000;
constexpr std::uint64_t most_definition_record = 4 << 20;
constexpr std::size_t mcap_index_entry_bytes = 16;  // time, offset

/// Walks through the records of a file and notes what it meets.
class McapWalk {
 public:
  explicit McapWalk(const FileBytes& file) : file_(file), window_(file, window_bytes) {}

  McapLayout run() {
    std::uint64_t at = mcap_magic.size();
    while (at < file_.size() && layout_.chunks.size() < most_mcap_chunks && !closed_) {
      const auto next = step(at);
      if (!next) break;
      at = *next;
    }
    index_is_doubtful_ = !closed_ && !in_summary_;
    finish_chunk();
    if (layout_.damages.empty() && !closed_) note({file_.size(), "the file was never closed"});
    const auto chunks = std::ranges::count(layout_.chunks, true, &McapChunk::is_chunk);
    if (layout_.damages.empty() && chunks < chunk_indexes_) note({file_.size(), "the index names chunks that are not there"});
    (summary_is_sound_ ? layout_.channels : layout_.doubtful).add(summary_);
    return std::move(layout_);
  }

 private:
  struct Record {
    McapOp op{};
    std::uint64_t begin = 0, data = 0, size = 0;  // size as far as it is in the file
    bool whole = false;
    std::uint64_t end() const { return data + size; }
  };

  /// The offset to go on from, or nothing at the end of what can be read.
  std::optional<std::uint64_t> step(std::uint64_t at) {
    if (at + mcap_magic.size() == file_.size() && as_text(window_.view(at, mcap_magic.size())) == mcap_magic) {
      closed_ = true;
      return std::nullopt;
    }
    ByteReader head(window_.view(at, mcap_record_head));
    Record record{static_cast<McapOp>(head.read<std::uint8_t>()), at, at + mcap_record_head};
    const auto claimed = head.read<std::uint64_t>();
    if (!head.ok()) return lost(at, "the file ends in the middle of a record");
    record.whole = claimed <= file_.size() - record.data;
    record.size = std::min(claimed, file_.size() - record.data);
    if (record.op == McapOp::chunk) return take_chunk(record);
    if (!record.whole) return lost(at, "the record is longer than the file");
    if (!take(record)) return lost(at, "a damaged record");
    resynced_ = false;
    return record.end();
  }

  bool take(const Record& record) {
    if (record.op != McapOp::message_index) finish_index();
    switch (record.op) {
      case McapOp::message:
        return take_message(record);
      case McapOp::schema:
      case McapOp::channel:
        return take_definition(record);
      case McapOp::message_index:
        return take_index(record);
      case McapOp::header:
        layout_.profile = ByteReader(view(record)).string();
        return true;
      case McapOp::chunk_index:
        ++chunk_indexes_;
        return true;
      case McapOp::data_end:
        finish_chunk();
        in_summary_ = true;
        return true;
      case McapOp::footer:
        return take_footer(record);
      default:
        return static_cast<std::uint8_t>(record.op) != 0;  // records of kinds unknown are to be skipped
    }
  }

  Bytes view(const Record& record) { return record.size > most_definition_record ? Bytes{} : window_.view(record.data, record.size); }

  std::optional<std::uint64_t> take_chunk(const Record& record) {
    finish_chunk();
    auto head = parse_mcap_chunk(window_.view(record.data, std::min<std::uint64_t>(record.size, most_chunk_head_bytes)));
    if (!head) return lost(record.begin, record.whole ? "a damaged chunk" : "the file ends in the middle of a chunk");
    McapChunk chunk;
    chunk.offset = record.begin;
    chunk.data_offset = record.data + head->bytes;
    chunk.data_size = std::min(head->size, file_.size() - chunk.data_offset);
    chunk.inflated_size = head->inflated_size;
    chunk.crc = head->crc;
    chunk.compression = head->compression.empty() ? "none" : head->compression;
    chunk.first = head->first;
    chunk.last = head->last;
    // Of the two lengths the inner one is believed; more fields may follow what is known of a chunk.
    const bool fits = head->size <= record.size - head->bytes, there = head->size <= file_.size() - chunk.data_offset;
    chunk.doubtful_end = !there;
    layout_.chunks.push_back(std::move(chunk));
    open_ = true;
    resynced_ = false;
    if (fits && record.whole) return record.end();
    if (!there) return lost(record.begin, "the chunk is longer than the file");
    note({record.begin, "the length of the chunk is false"});
    return layout_.chunks.back().data_offset + head->size;
  }

  bool take_message(const Record& record) {
    const auto message = parse_mcap_message(window_.view(record.data, std::min<std::uint64_t>(record.size, mcap_message_head)));
    if (!message) return false;
    add_to_region(record);
    McapChunk& region = layout_.chunks.back();
    region.first = region.indexed ? std::min(region.first, message->log_time) : message->log_time;
    region.last = region.indexed ? std::max(region.last, message->log_time) : message->log_time;
    region.indexed = true;
    if (layout_.times.size() < most_connections || layout_.times.contains(message->channel))
      layout_.times[message->channel].add(message->log_time);
    return true;
  }

  bool take_definition(const Record& record) {
    McapChannels& channels = in_summary_ ? summary_ : layout_.channels;
    if (record.op == McapOp::schema) {
      auto schema = parse_mcap_schema(view(record));
      if (schema) channels.add(*std::move(schema));
      return schema.has_value();
    }
    auto channel = parse_mcap_channel(view(record));
    if (channel) channels.add(*std::move(channel));
    return channel.has_value();
  }

  /// Extends the records outside of chunks; they end where anything else begins.
  void add_to_region(const Record& record) {
    const bool extend = in_region_ && layout_.chunks.back().data_size < most_region_bytes &&
                        layout_.chunks.back().data_offset + layout_.chunks.back().data_size == record.begin;
    if (!extend) {
      finish_chunk();
      McapChunk region;
      region.is_chunk = false;
      region.offset = region.data_offset = record.begin;
      region.compression = "none";
      layout_.chunks.push_back(region);
      in_region_ = true;
    }
    layout_.chunks.back().data_size = record.end() - layout_.chunks.back().data_offset;
    layout_.chunks.back().inflated_size = layout_.chunks.back().data_size;
  }

  bool take_index(const Record& record) {
    if (!open_) return true;
    ByteReader reader(window_.view(record.data, std::min<std::uint64_t>(record.size, 6)));
    const auto channel = reader.read<std::uint16_t>();
    const std::uint64_t bytes = reader.read<std::uint32_t>();
    if (!reader.ok() || bytes + 6 > record.size || bytes % mcap_index_entry_bytes != 0) return false;
    TimesSummary times;
    for (std::uint64_t done = 0; done < bytes;) {
      const auto piece = static_cast<std::size_t>(std::min<std::uint64_t>(bytes - done, window_bytes));
      ByteReader entries(window_.view(record.data + 6 + done, piece));
      for (std::size_t i = 0; i < piece / mcap_index_entry_bytes; ++i) {
        times.add(recorded_time(entries.read<std::uint64_t>()));
        entries.skip(8);
      }
      if (!entries.ok()) return false;
      done += piece;
    }
    if (times.count > 0) index_[channel].append(times);
    return true;
  }

  /// What the index says of a chunk counts only when it fits what the chunk itself says.
  void finish_index() {
    if (!open_ || index_.empty()) return;
    McapChunk& chunk = layout_.chunks.back();
    Time first = Time::max(), last = Time::min();
    for (const auto& [channel, times] : index_) {
      first = std::min(first, times.first);
      last = std::max(last, times.last);
    }
    if (first == chunk.first && last == chunk.last && !chunk.doubtful_end) {
      chunk.indexed = true;
      for (const auto& [channel, times] : index_) {
        chunk.channels.insert(channel);
        layout_.times[channel].append(times);
      }
    }
    open_ = false;
    index_.clear();
  }

  void finish_chunk() {
    if (index_is_doubtful_) index_.clear();
    finish_index();
    open_ = in_region_ = false;
    index_.clear();
  }

  bool take_footer(const Record& record) {
    constexpr std::size_t covered = mcap_record_head + 16;  // of the footer, by its own checksum
    ByteReader reader(window_.view(record.data, std::min<std::uint64_t>(record.size, 20)));
    const auto summary = reader.read<std::uint64_t>();
    reader.skip(8);
    const auto crc = reader.read<std::uint32_t>();
    if (!reader.ok()) return false;
    if (summary == 0 || crc == 0) return true;
    if (summary > record.begin) return false;
    std::uint32_t found = 0;
    for (std::uint64_t at = summary, end = record.begin + covered; at < end;) {
      const Bytes bytes = window_.view(at, static_cast<std::size_t>(std::min<std::uint64_t>(window_bytes, end - at)));
      if (bytes.empty()) return false;
      found = crc32(bytes, found);
      at += bytes.size();
    }
    summary_is_sound_ = found == crc;
    if (!summary_is_sound_) note({summary, "the checksum of the summary is wrong"});
    return true;
  }

  /// Notes damage at `at` and looks for the next chunk or message. When a chunk's length is false, that may lie within its claimed data.
  std::optional<std::uint64_t> lost(std::uint64_t at, const std::string& reason) {
    const bool in_chunk = open_ && layout_.chunks.back().offset == at;
    const auto next = find_mcap_record(file_, in_chunk ? layout_.chunks.back().data_offset : at + 1, layout_.times);
    if (in_chunk && !next) {
      note({file_.size(), "the file ends in the middle of a chunk"});
    } else if (!resynced_) {
      note({at, reason});
    }
    index_is_doubtful_ = true;
    if (in_chunk && next) {
      McapChunk& chunk = layout_.chunks.back();
      chunk.doubtful_end = true;
      chunk.data_size = std::min(chunk.data_size, *next - chunk.data_offset);
    }
    finish_chunk();
    index_is_doubtful_ = false;
    in_summary_ = false;
    resynced_ = true;
    return next;
  }

  void note(Damage damage) {
    if (layout_.damages.size() < most_damages) layout_.damages.push_back(std::move(damage));
  }

  const FileBytes& file_;
  FileWindow window_;
  McapLayout layout_;
  McapChannels summary_;
  bool summary_is_sound_ = false, in_summary_ = false, closed_ = false;
  bool open_ = false;       // the last record was a chunk or one of its index records
  bool in_region_ = false;  // or a message outside of chunks
  bool index_is_doubtful_ = false;
  bool resynced_ = false;
  std::map<std::uint16_t, TimesSummary> index_;  // of the last chunk
  std::ptrdiff_t chunk_indexes_ = 0;
};

}  // namespace

McapLayout read_mcap_layout(const FileBytes& file) {
  if (file.size() == 0) throw InputError(file.name() + ": the file is empty");
  std::vector<std::uint8_t> begin(mcap_magic.size());
  begin.resize(file.read_at(0, begin));
  if (as_text(begin) != mcap_magic) throw InputError(file.name() + ": not an MCAP file");
  return McapWalk(file).run();
}

}  // namespace kilvo::lab
