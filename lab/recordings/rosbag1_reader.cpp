#include "lab/recordings/rosbag1_reader.hpp"

#include <set>

namespace kilvo::lab {

Rosbag1Reader::Rosbag1Reader(FileBytes bytes) : ChunkedReader(std::move(bytes)) {
  BagLayout layout = read_bag_layout(file());
  chunks_ = std::move(layout.chunks);
  Found found;
  for (const BagChunk& chunk : chunks_) {
    const std::uint64_t memory = chunk.compression == "none" ? 0 : chunk.inflated_size;
    found.spans.push_back({chunk.first, chunk.last, chunk.data_size, memory, chunk.indexed, chunk.new_connections});
  }
  found.times = std::move(layout.times);
  found.damages = std::move(layout.damages);
  found.after = std::move(layout.footer);
  start(std::move(found));
}

StorageSummary Rosbag1Reader::storage() const {
  std::set<std::string> names;
  for (const BagChunk& chunk : chunks_) names.insert(chunk.compression);
  StorageSummary summary{"ROS 1 bag", {}, chunks_.size()};
  for (const auto& name : names) summary.compression += (summary.compression.empty() ? "" : " ") + name;
  return summary;
}

std::unique_ptr<ChunkReader> Rosbag1Reader::open(std::size_t span) { return std::make_unique<BagChunkReader>(file(), chunks_[span]); }

}  // namespace kilvo::lab
