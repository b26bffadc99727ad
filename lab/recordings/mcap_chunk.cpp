#include "lab/recordings/mcap_chunk.hpp"

#include "lab/recordings/inflate.hpp"

namespace kilvo::lab {

McapChunkReader::McapChunkReader(const FileBytes& file, const McapChunk& chunk, McapChannels& channels)
    : channels_(channels),
      offset_(chunk.compression == "none" ? chunk.data_offset : chunk.offset),
      direct_(chunk.compression == "none"),
      doubtful_end_(chunk.doubtful_end) {
  load(file, chunk);
}

void McapChunkReader::load(const FileBytes& file, const McapChunk& chunk) {
  std::string fault;
  if (chunk.data_size > most_chunk_bytes) {
    fault = "is too large";
  } else {
    bytes_.resize(static_cast<std::size_t>(chunk.data_size));
    bytes_.resize(file.read_at(chunk.data_offset, bytes_));
    good_ = bytes_.size();
    if (!direct_) {
      Inflated inflated = inflate_chunk(chunk.compression, bytes_, static_cast<std::size_t>(chunk.inflated_size));
      bytes_ = std::move(inflated.bytes);
      good_ = inflated.good;
      fault = std::move(inflated.fault);
    }
  }
  // A chunk whose end is missing has no checksum that could fit; that its end is missing is known already.
  const bool checked = chunk.crc != 0 && !doubtful_end_ && fault.empty();
  if (checked && crc32(bytes_) != chunk.crc) {
    fault = "has a wrong checksum";
    good_ = 0;
  }
  if (!fault.empty() && !(doubtful_end_ && good_ > 0)) damage_ = Damage{chunk.offset, "the chunk " + fault};
}

void McapChunkReader::note(std::uint64_t at, const std::string& reason) {
  if (!damage_ && !doubtful_end_) damage_ = Damage{direct_ ? offset_ + at : offset_, reason};
  position_ = bytes_.size();
}

void McapChunkReader::define(Bytes record, McapOp op, const std::function<void(const Channel&)>& on_connection) {
  if (op == McapOp::schema) {
    if (auto schema = parse_mcap_schema(record)) channels_.add(*std::move(schema));
  } else if (const auto channel = parse_mcap_channel(record)) {
    channels_.add(*channel);
    on_connection(channels_.channel(*channel));
  }
}

std::optional<MessageEntry> McapChunkReader::scan(const std::function<void(const Channel&)>& on_connection) {
  const std::size_t end = on_connection ? bytes_.size() : good_;
  while (position_ < end) {
    const std::size_t begin = position_;
    ByteReader reader(Bytes(bytes_).subspan(begin));
    const auto op = static_cast<McapOp>(reader.read<std::uint8_t>());
    const auto size = reader.read<std::uint64_t>();
    if (!reader.ok() || size > reader.remaining() || static_cast<std::uint8_t>(op) == 0) {
      note(begin, "a damaged record in a chunk");
      return std::nullopt;
    }
    const Bytes record = reader.take(static_cast<std::size_t>(size));
    position_ = begin + mcap_record_head + record.size();
    if (op == McapOp::message) {
      const auto head = parse_mcap_message(record);
      if (!head) {
        note(begin, "a message shorter than its head");
        return std::nullopt;
      }
      if (position_ > good_) continue;
      const std::uint64_t data = begin + mcap_record_head + mcap_message_head;
      return MessageEntry{head->log_time, data, static_cast<std::uint32_t>(record.size() - mcap_message_head), head->channel};
    }
    if (on_connection && (op == McapOp::schema || op == McapOp::channel)) define(record, op, on_connection);
  }
  return std::nullopt;
}

std::optional<Bytes> McapChunkReader::message(const MessageEntry& entry) {
  const Bytes bytes = Bytes(bytes_).subspan(static_cast<std::size_t>(entry.offset), entry.size);
  if (!is_zstd(bytes) || channels_.encoding(static_cast<std::uint16_t>(entry.connection)) != Encoding::cdr) return bytes;
  Inflated inflated = inflate_zstd(bytes, most_message_bytes);
  if (!inflated.fault.empty()) {
    damage_ = Damage{direct_ ? offset_ + entry.offset : offset_, "a message: " + inflated.fault};
    return std::nullopt;
  }
  message_ = std::move(inflated.bytes);
  return Bytes(message_);
}

}  // namespace kilvo::lab
