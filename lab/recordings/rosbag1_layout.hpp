// What lies where in a ROS 1 bag: found by walking from record to record through the whole file, which needs a few reads per chunk and
// works whether or not the bag was closed properly. The bag's own index at its end is not relied upon.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "lab/recordings/chunked_reader.hpp"
#include "lab/recordings/rosbag1_record.hpp"

namespace kilvo::lab {

struct BagChunk {
  std::uint64_t offset = 0;       // of the chunk's record
  std::uint64_t data_offset = 0;  // of its (compressed) content
  std::uint64_t data_size = 0;    // as far as it is in the file and no other chunk begins
  std::uint32_t inflated_size = 0;
  std::string compression;       // none, lz4, bz2
  bool doubtful_end = false;     // its length is false, or the file ends in it: said among the damages
  bool indexed = false;          // its index records were read, and with them the times below
  bool new_connections = false;  // the index has a connection that no chunk before it has
  Time first{}, last{};
};

struct BagLayout {
  std::vector<BagChunk> chunks;                 // in the order of the file
  std::map<std::uint32_t, Channel> footer;      // connection records at the end of the bag
  std::map<std::uint32_t, TimesSummary> times;  // by connection, over the indexed chunks
  std::vector<Damage> damages;                  // in the order of the file; at most most_damages
};

inline constexpr std::size_t most_chunks = 1'000'000;  // 0.7 TB of them

/// Throws InputError when this is no ROS 1 bag 2.0 at all; anything worse inside is damage, which is skipped to the next chunk.
BagLayout read_bag_layout(const FileBytes& file);

}  // namespace kilvo::lab
