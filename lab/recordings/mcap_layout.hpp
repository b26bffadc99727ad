// What lies where in an MCAP file: found by walking from record to record through the whole file, which needs a few reads per chunk and
// works whether or not the file was closed properly. The index at its end is not relied upon; of the summary the channels are, if its
// checksum fits.
#pragma once

#include <set>

#include "lab/recordings/chunked_reader.hpp"
#include "lab/recordings/mcap_channels.hpp"

namespace kilvo::lab {

/// A chunk record, or records that follow each other outside of chunks.
struct McapChunk {
  std::uint64_t offset = 0;       // of the chunk's record
  std::uint64_t data_offset = 0;  // of its (compressed) records
  std::uint64_t data_size = 0;    // as far as they are in the file
  std::uint64_t inflated_size = 0;
  std::uint32_t crc = 0;    // 0: not known
  std::string compression;  // none, lz4, zstd
  bool is_chunk = true;
  bool doubtful_end = false;  // the file ends in it: reported among the damages
  bool indexed = false;       // its times are known
  Time first{}, last{};
  std::set<std::uint16_t> channels;  // that its index names
};

struct McapLayout {
  std::vector<McapChunk> chunks;  // in the order of the file
  McapChannels channels;          // outside of chunks, and of the summary if that is sound
  McapChannels doubtful;          // of a summary whose checksum is wrong or missing
  std::map<std::uint32_t, TimesSummary> times;
  std::vector<Damage> damages;
  std::string profile;
};

/// Throws InputError when this is no MCAP file at all; anything worse inside is damage, which is skipped to the next chunk.
McapLayout read_mcap_layout(const FileBytes& file);

}  // namespace kilvo::lab
