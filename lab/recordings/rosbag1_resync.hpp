// Finding one's place again in a damaged bag.
#pragma once

#include <optional>

#include "lab/recordings/file_bytes.hpp"
#include "lab/recordings/rosbag1_record.hpp"

namespace kilvo::lab {

/// True when the header says all that a chunk needs.
bool is_chunk_header(const BagRecordHeader& header);

/// The offset of the first chunk record that begins at or after `from`, known by the look of its header.
std::optional<std::uint64_t> find_chunk(const FileBytes& file, std::uint64_t from);

}  // namespace kilvo::lab
