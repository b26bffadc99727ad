// Reads MCAP: chunks uncompressed, lz4 or zstd, or none at all; with an index or without; closed properly, or cut short, or damaged.
#pragma once

#include "lab/recordings/mcap_chunk.hpp"

namespace kilvo::lab {

class McapReader final : public ChunkedReader {
 public:
  /// Throws InputError when the file cannot be read or is no MCAP file.
  explicit McapReader(const std::filesystem::path& path) : McapReader(FileBytes(path)) {}
  explicit McapReader(FileBytes bytes);

  StorageSummary storage() const override;
  const std::vector<McapChunk>& chunks() const { return chunks_; }

 private:
  std::unique_ptr<ChunkReader> open(std::size_t span) override;

  std::vector<McapChunk> chunks_;
  std::unique_ptr<McapChannels> channels_;  // chunk readers point to it
};

}  // namespace kilvo::lab
