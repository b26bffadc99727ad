#include "lab/recordings/mcap_resync.hpp"

#include <algorithm>
#include <vector>

#include "lab/recordings/mcap_record.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t look = mcap_record_head + most_chunk_head_bytes;  // bytes that are looked at
constexpr Duration near = std::chrono::hours(1);

bool is_chunk(Bytes record, std::uint64_t left) {
  ByteReader reader(record);
  reader.skip(1);
  const auto size = reader.read<std::uint64_t>();
  if (!reader.ok() || size > left - mcap_record_head) return false;
  const auto head = parse_mcap_chunk(record.subspan(mcap_record_head));
  return head && head->first <= head->last && head->size == size - head->bytes;
}

/// A message whose end another record, or the end of the file, follows.
bool is_message(const FileBytes& file, std::uint64_t at, Bytes record, const std::map<std::uint32_t, TimesSummary>& known) {
  ByteReader reader(record);
  reader.skip(1);
  const auto size = reader.read<std::uint64_t>();
  const std::uint64_t left = file.size() - at - mcap_record_head;
  if (!reader.ok() || size < mcap_message_head || size > left || size > most_message_bytes + mcap_message_head) return false;
  const auto head = parse_mcap_message(record.subspan(mcap_record_head));
  const auto times = head ? known.find(head->channel) : known.end();
  if (times == known.end()) return false;
  const TimesSummary& t = times->second;
  if (head->log_time < t.first - std::min(near, t.first.time_since_epoch()) || head->log_time - t.last > near) return false;
  std::array<std::uint8_t, mcap_record_head> next{};
  if (file.read_at(at + mcap_record_head + size, next) < next.size()) return true;
  ByteReader following(next);
  const auto op = following.read<std::uint8_t>();
  return op >= 1 && op <= 15 && following.read<std::uint64_t>() <= left - size;
}

}  // namespace

std::optional<std::uint64_t> find_mcap_record(const FileBytes& file, std::uint64_t from,
                                              const std::map<std::uint32_t, TimesSummary>& known) {
  std::vector<std::uint8_t> block;
  std::size_t block_bytes = first_block_bytes;
  for (std::uint64_t at = from; at < file.size(); at += block.size() - look) {
    block.resize(block_bytes);
    const Bytes bytes = Bytes(block).first(file.read_at(at, block));
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const auto op = static_cast<McapOp>(bytes[i]);
      if (op != McapOp::chunk && op != McapOp::message) continue;
      const Bytes record = bytes.subspan(i, std::min(look, bytes.size() - i));
      if (op == McapOp::chunk ? is_chunk(record, file.size() - at - i) : is_message(file, at + i, record, known)) return at + i;
    }
    if (bytes.size() < block.size()) break;
    block_bytes = std::min(2 * block_bytes, most_block_bytes);
  }
  return std::nullopt;
}

}  // namespace kilvo::lab
