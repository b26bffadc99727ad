// The records of an MCAP file (https://mcap.dev/spec): an opcode, a length, and fields, of which there may be more than are known here.
#pragma once

#include <optional>
#include <string>

#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

inline constexpr std::string_view mcap_magic{"\x89MCAP0\r\n", 8};

enum class McapOp : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  attachment = 9,
  attachment_index = 10,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  summary_offset = 14,
  data_end = 15,
};

inline constexpr std::size_t mcap_record_head = 9;    // opcode and length
inline constexpr std::size_t mcap_message_head = 22;  // of a message: channel, sequence, two times

struct McapSchema {
  std::uint16_t id = 0;
  std::string name;
  std::string encoding;
  std::string text;  // what `data` holds; empty when that is long
};

struct McapChannel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;  // 0: none
  std::string topic;
  std::string encoding;
};

struct McapMessageHead {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  Time log_time{}, publish_time{};
};

struct McapChunkHead {
  Time first{}, last{};
  std::uint64_t inflated_size = 0;
  std::uint32_t crc = 0;  // of the inflated records; 0: not known
  std::string compression;
  std::uint64_t size = 0;  // of the records as they are in the file
  std::size_t bytes = 0;   // of this head
};

/// Nothing when the fields do not fit the content.
std::optional<McapSchema> parse_mcap_schema(Bytes content);
std::optional<McapChannel> parse_mcap_channel(Bytes content);
std::optional<McapMessageHead> parse_mcap_message(Bytes content);
/// Needs the first `most_chunk_head_bytes` of the content only. Nothing unless the compression is one that MCAP knows.
std::optional<McapChunkHead> parse_mcap_chunk(Bytes content);
inline constexpr std::size_t most_chunk_head_bytes = 44;

/// CRC-32 as zlib has it, continued from `crc` (0 to begin with).
std::uint32_t crc32(Bytes bytes, std::uint32_t crc = 0);

}  // namespace kilvo::lab
