// Reads ROS 1 bags of version 2.0: chunks uncompressed, bz2 or lz4; closed properly, or cut short, or damaged.
#pragma once

#include "lab/recordings/chunked_reader.hpp"
#include "lab/recordings/rosbag1_chunk.hpp"

namespace kilvo::lab {

class Rosbag1Reader final : public ChunkedReader {
 public:
  /// Throws InputError when the file cannot be read or is no such bag.
  explicit Rosbag1Reader(const std::filesystem::path& path) : Rosbag1Reader(FileBytes(path)) {}
  explicit Rosbag1Reader(FileBytes bytes);

  StorageSummary storage() const override;
  const std::vector<BagChunk>& chunks() const { return chunks_; }

 private:
  std::unique_ptr<ChunkReader> open(std::size_t span) override;

  std::vector<BagChunk> chunks_;
};

}  // namespace kilvo::lab
