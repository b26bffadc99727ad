#include "lab/recordings/mcap_record.hpp"

#include <array>

namespace kilvo::lab {
namespace {

using CrcTables = std::array<std::array<std::uint32_t, 256>, 8>;

constexpr CrcTables crc_tables() {
  CrcTables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320U : 0U);
    tables[0][i] = crc;
  }
  for (std::size_t k = 1; k < tables.size(); ++k) {
    for (std::size_t i = 0; i < 256; ++i) tables[k][i] = (tables[k - 1][i] >> 8) ^ tables[0][tables[k - 1][i] & 0xFF];
  }
  return tables;
}

}  // namespace

std::optional<McapSchema> parse_mcap_schema(Bytes content) {
  ByteReader reader(content);
  McapSchema schema;
  schema.id = reader.read<std::uint16_t>();
  schema.name = reader.string();
  schema.encoding = reader.string();
  const std::string_view text = reader.string();
  if (!reader.ok() || schema.id == 0) return std::nullopt;
  if (text.size() <= most_definition_bytes) schema.text = text;
  return schema;
}

std::optional<McapChannel> parse_mcap_channel(Bytes content) {
  ByteReader reader(content);
  McapChannel channel;
  channel.id = reader.read<std::uint16_t>();
  channel.schema = reader.read<std::uint16_t>();
  channel.topic = reader.string();
  channel.encoding = reader.string();
  reader.array();  // metadata
  return reader.ok() ? std::optional(std::move(channel)) : std::nullopt;
}

std::optional<McapMessageHead> parse_mcap_message(Bytes content) {
  ByteReader reader(content);
  McapMessageHead message;
  message.channel = reader.read<std::uint16_t>();
  message.sequence = reader.read<std::uint32_t>();
  message.log_time = recorded_time(reader.read<std::uint64_t>());
  message.publish_time = recorded_time(reader.read<std::uint64_t>());
  return reader.ok() ? std::optional(message) : std::nullopt;
}

std::optional<McapChunkHead> parse_mcap_chunk(Bytes content) {
  ByteReader reader(content);
  McapChunkHead chunk;
  chunk.first = recorded_time(reader.read<std::uint64_t>());
  chunk.last = recorded_time(reader.read<std::uint64_t>());
  chunk.inflated_size = reader.read<std::uint64_t>();
  chunk.crc = reader.read<std::uint32_t>();
  chunk.compression = reader.string();
  chunk.size = reader.read<std::uint64_t>();
  chunk.bytes = reader.position();
  const std::string& c = chunk.compression;
  if (!reader.ok() || (!c.empty() && c != "lz4" && c != "zstd")) return std::nullopt;
  return chunk;
}

std::uint32_t crc32(Bytes bytes, std::uint32_t crc) {
  static constexpr CrcTables tables = crc_tables();
  crc = ~crc;
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint32_t low = 0, high = 0;
    std::memcpy(&low, bytes.data() + i, 4);
    std::memcpy(&high, bytes.data() + i + 4, 4);
    low ^= crc;
    crc = tables[7][low & 0xFF] ^ tables[6][low >> 8 & 0xFF] ^ tables[5][low >> 16 & 0xFF] ^ tables[4][low >> 24] ^ tables[3][high & 0xFF] ^
          tables[2][high >> 8 & 0xFF] ^ tables[1][high >> 16 & 0xFF] ^ tables[0][high >> 24];
  }
  for (; i < bytes.size(); ++i) crc = (crc >> 8) ^ tables[0][(crc ^ bytes[i]) & 0xFF];
  return ~crc;
}

}  // namespace kilvo::lab
