// The compressions that recordings are written with.
#pragma once

#include <vector>

#include "lab/messages/bytes.hpp"

namespace kilvo::lab {

/// An LZ4 frame as roslz4 and MCAP read it: independent blocks, with a checksum over the content. Throws OutputError.
std::vector<std::uint8_t> deflate_lz4(Bytes bytes);

/// One zstd frame, which says how large its content is. Throws OutputError.
std::vector<std::uint8_t> deflate_zstd(Bytes bytes);

}  // namespace kilvo::lab
