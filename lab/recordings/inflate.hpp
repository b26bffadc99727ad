// The compressions of recordings.
#pragma once

#include <string>
#include <vector>

#include "lab/messages/bytes.hpp"

namespace kilvo::lab {

/// Chunks that claim to be larger than this when inflated are refused. (rosbag's default chunk is 0.75 MB.)
inline constexpr std::size_t most_chunk_bytes = std::size_t{256} << 20;

struct Inflated {
  std::vector<std::uint8_t> bytes;
  std::size_t good = 0;  // so many of them are known to be right; the rest is what a damaged chunk gave
  std::string fault;     // empty: all of the chunk
};

/// `compression` is "lz4", "bz2" or "zstd"; `size` what the chunk claims to be when inflated: more is a fault. Input that only ends too
/// early gives a good beginning; of input that fails its checksum nothing is good, since nobody knows where it went wrong.
Inflated inflate_chunk(std::string_view compression, Bytes compressed, std::size_t size);

/// One or several zstd frames, up to `most` bytes; more is a fault.
Inflated inflate_zstd(Bytes compressed, std::size_t most);

/// Begins as a zstd frame does.
bool is_zstd(Bytes bytes);

}  // namespace kilvo::lab
