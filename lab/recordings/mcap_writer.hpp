// Writes MCAP with an index, as Foxglove and rosbag2 read it.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <vector>

#include "lab/messages/byte_writer.hpp"
#include "lab/recordings/message_writer.hpp"

namespace kilvo::lab {

class McapWriter final : public MessageWriter {
 public:
  enum class Compression : std::uint8_t { none, lz4, zstd };

  /// A chunk is written when it holds `chunk_bytes`. `profile`: "ros2" where every message is in CDR, "ros1", or nothing. Throws
  /// OutputError.
  McapWriter(const std::filesystem::path& path, Compression compression, const std::string& profile, std::size_t chunk_bytes = 1 << 20);
  /// Closes; a failure to do so is not reported: call close() to know.
  ~McapWriter() override;
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  std::uint32_t add_channel(const Channel& channel) override;
  void write(std::uint32_t channel, Time recorded, Bytes message) override;
  void flush() override;
  void close() override;

 private:
  struct Definition {
    std::vector<std::uint8_t> schema, channel;  // records; no schema where the type has no definition
    bool first_of_schema = false;               // of the channels that share it
    bool written = false;                       // in a chunk
    std::uint64_t count = 0;
    std::uint32_t sequence = 0;
  };
  struct ChunkIndex {
    std::uint64_t offset, size;  // of the chunk's record
    Time first, last;
    std::map<std::uint16_t, std::uint64_t> index_offsets;  // of the message index records, by channel
    std::uint64_t index_size;
    std::uint64_t compressed, inflated;
  };

  void put(const std::vector<std::uint8_t>& bytes);
  void write_chunk();
  void write_indexes(ChunkIndex& chunk);
  std::vector<std::uint8_t> summary(std::uint64_t begin) const;

  std::string name_;
  std::ofstream file_;
  std::uint64_t position_ = 0;
  Compression compression_;
  std::size_t chunk_bytes_;
  bool closed_ = false;
  std::vector<Definition> channels_;  // by id
  std::map<std::string, std::uint16_t> schemas_;
  ByteWriter content_;  // of the chunk in the making
  std::map<std::uint16_t, std::vector<std::pair<Time, std::uint64_t>>> index_;
  std::vector<ChunkIndex> chunks_;
  Time first_ = Time::max(), last_ = Time::min();
};

}  // namespace kilvo::lab
