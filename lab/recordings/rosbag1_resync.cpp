#include "lab/recordings/rosbag1_resync.hpp"

#include <algorithm>
#include <array>
#include <functional>

namespace kilvo::lab {
namespace {

constexpr std::size_t longest_chunk_header = 128;  // three short fields: 40 bytes as everybody writes them

// The one field that every chunk header has, wherever it stands among the others: length 4, op=5.
constexpr std::array<std::uint8_t, 8> op_field{4, 0, 0, 0, 'o', 'p', '=', 5};

/// A chunk record whose op field is at `op` in `bytes`: the offset at which it begins.
std::optional<std::size_t> record_around(Bytes bytes, std::size_t op) {
  for (std::size_t before = 4; before <= std::min(op, longest_chunk_header); ++before) {
    ByteReader reader(bytes.subspan(op - before));
    const std::size_t header_size = reader.read<std::uint32_t>();
    if (header_size > longest_chunk_header || header_size + 4 < before + op_field.size()) continue;
    const auto header = parse_bag_header(reader.take(header_size));
    if (reader.ok() && header && header->op == BagOp::chunk && is_chunk_header(*header)) return op - before;
  }
  return std::nullopt;
}

}  // namespace

bool is_chunk_header(const BagRecordHeader& header) {
  const auto& c = header.compression;
  return header.size.has_value() && (c == "none" || c == "lz4" || c == "bz2");
}

std::optional<std::uint64_t> find_chunk(const FileBytes& file, std::uint64_t from) {
  // Blocks overlap by two headers, so that a header on their border is whole in one of them.
  constexpr std::size_t overlap = 2 * longest_chunk_header;
  const std::boyer_moore_horspool_searcher searcher(op_field.begin(), op_field.end());
  std::vector<std::uint8_t> block;
  std::size_t block_bytes = first_block_bytes;
  for (std::uint64_t at = from; at < file.size(); at += block.size() - overlap) {
    block.resize(block_bytes);
    const Bytes bytes = Bytes(block).first(file.read_at(at, block));
    auto op = bytes.begin();
    while ((op = std::search(op, bytes.end(), searcher)) != bytes.end()) {
      if (const auto begin = record_around(bytes, static_cast<std::size_t>(op - bytes.begin()))) return at + *begin;
      ++op;
    }
    if (bytes.size() < block.size()) break;
    block_bytes = std::min(2 * block_bytes, most_block_bytes);
  }
  return std::nullopt;
}

}  // namespace kilvo::lab
