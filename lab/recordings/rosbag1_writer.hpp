// Writes ROS 1 bags of version 2.0 with an index, as any ROS 1 tool expects them.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "lab/messages/byte_writer.hpp"
#include "lab/messages/encode.hpp"
#include "lab/recordings/message_writer.hpp"

namespace kilvo::lab {

/// As rosbag has it.
inline constexpr std::size_t default_chunk_bytes = 768 << 10;

class Rosbag1Writer final : public MessageWriter {
 public:
  enum class Compression : std::uint8_t { none, lz4 };

  /// A chunk is written when it holds `chunk_bytes`. Throws OutputError.
  explicit Rosbag1Writer(const std::filesystem::path& path, Compression compression = Compression::none,
                         std::size_t chunk_bytes = default_chunk_bytes);
  /// Closes; a failure to do so is not told: call close() to hear of it.
  ~Rosbag1Writer() override;
  Rosbag1Writer(const Rosbag1Writer&) = delete;
  Rosbag1Writer& operator=(const Rosbag1Writer&) = delete;

  /// The id to write messages of this topic with.
  std::uint32_t add_connection(const std::string& topic, const MessageType& type);
  /// Of a channel in the encoding of ROS 1, with its definition and sum.
  std::uint32_t add_channel(const Channel& channel) override;

  /// `recorded`: when the message arrived; best given in ascending order. Throws OutputError when the disk is full.
  void write(std::uint32_t connection, Time recorded, Bytes message) override;

  /// Ends the chunk in the making: what was written so far can be read, even if the bag is never closed.
  void flush() override;

  /// Writes the last chunk and the index. Throws OutputError.
  void close() override;

 private:
  struct Connection {
    Channel channel;
    bool defined = false;  // in a chunk
  };
  struct IndexEntry {
    Time time;
    std::uint32_t offset;  // of the record, in the inflated chunk
  };
  struct ChunkInfo {
    std::uint64_t offset;
    Time first, last;
    std::map<std::uint32_t, std::uint32_t> counts;  // by connection
  };

  void put(const std::vector<std::uint8_t>& bytes);
  void write_bag_header(std::uint64_t index_pos);
  void write_chunk();

  std::string name_;
  std::ofstream file_;
  std::uint64_t position_ = 0;
  Compression compression_;
  std::size_t chunk_bytes_;
  bool closed_ = false;
  std::vector<Connection> connections_;
  ByteWriter content_;  // of the chunk in the making
  std::map<std::uint32_t, std::vector<IndexEntry>> index_;
  std::vector<ChunkInfo> chunks_;
};

}  // namespace kilvo::lab
