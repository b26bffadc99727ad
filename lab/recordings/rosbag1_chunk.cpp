#include "lab/recordings/rosbag1_chunk.hpp"

#include <algorithm>

#include "lab/recordings/inflate.hpp"

namespace kilvo::lab {
namespace {

bool is_compressed(const BagChunk& chunk) { return chunk.compression != "none"; }

}  // namespace

BagChunkReader::BagChunkReader(const FileBytes& file, const BagChunk& chunk)
    : file_(&file),
      chunk_(chunk),
      size_(chunk.data_size),
      good_(chunk.data_size),
      window_(file, is_compressed(chunk) ? 0 : std::min<std::uint64_t>(window_bytes, chunk.data_size)) {
  if (!is_compressed(chunk)) return;
  Inflated inflated;
  if (chunk.data_size > most_chunk_bytes) {
    inflated.fault = "is too large";
  } else {
    std::vector<std::uint8_t> compressed(static_cast<std::size_t>(chunk.data_size));
    compressed.resize(file.read_at(chunk.data_offset, compressed));
    inflated = inflate_chunk(chunk.compression, compressed, chunk.inflated_size);
  }
  inflated_ = std::move(inflated.bytes);
  size_ = inflated_.size();
  good_ = inflated.good;
  // That such a chunk lacks its end is known already.
  if (!inflated.fault.empty() && !(chunk.doubtful_end && good_ > 0)) damage_ = Damage{chunk.offset, "the chunk " + inflated.fault};
}

Bytes BagChunkReader::view(std::uint64_t offset, std::uint64_t count) {
  if (offset >= size_) return {};
  const auto there = static_cast<std::size_t>(std::min(count, size_ - offset));
  if (is_compressed(chunk_)) return Bytes(inflated_).subspan(static_cast<std::size_t>(offset), there);
  return window_.view(chunk_.data_offset + offset, there);
}

void BagChunkReader::note(std::uint64_t offset, const std::string& reason) {
  if (!damage_ && !chunk_.doubtful_end) damage_ = Damage{is_compressed(chunk_) ? chunk_.offset : chunk_.data_offset + offset, reason};
  position_ = size_;
}

std::optional<MessageEntry> BagChunkReader::scan(const std::function<void(const Channel&)>& on_connection) {
  const std::uint64_t end = on_connection ? size_ : good_;
  while (position_ < end) {
    const std::uint64_t begin = position_;
    const std::size_t header_size = ByteReader(view(begin, 4)).read<std::uint32_t>();
    ByteReader reader(header_size <= most_header_bytes ? view(begin, header_size + 8) : Bytes{});
    reader.skip(4);
    const auto header = parse_bag_header(reader.take(header_size));
    const auto data_size = reader.read<std::uint32_t>();
    const std::uint64_t data = begin + header_size + 8;
    if (!reader.ok() || !header || data_size > size_ - data) {
      note(begin, "a damaged record in a chunk");
      return std::nullopt;
    }
    position_ = data + data_size;
    if (header->op == BagOp::message && header->connection && header->time) {
      if (position_ > good_) continue;
      return MessageEntry{*header->time, data, data_size, *header->connection};
    }
    if (header->op != BagOp::connection) {
      note(begin, "a record in a chunk that does not belong there");
      return std::nullopt;
    }
    if (on_connection && data_size <= most_connection_bytes) {
      // The header again, now together with the data: both must be in the window at once.
      ByteReader whole(view(begin, header_size + 8 + data_size));
      whole.skip(4);
      const auto again = parse_bag_header(whole.take(header_size));
      whole.skip(4);
      const Bytes text = whole.take(data_size);
      if (const auto connection = again && whole.ok() ? parse_connection(*again, text) : std::nullopt) on_connection(*connection);
    }
  }
  return std::nullopt;
}

std::optional<Bytes> BagChunkReader::message(const MessageEntry& entry) {
  if (is_compressed(chunk_) || entry.size <= window_bytes) return view(entry.offset, entry.size);
  if (entry.size > large_.size()) large_.resize(entry.size);
  return Bytes(large_).first(file_->read_at(chunk_.data_offset + entry.offset, std::span(large_).first(entry.size)));
}

}  // namespace kilvo::lab
