// Finding one's place again in a damaged MCAP file.
#pragma once

#include <map>
#include <optional>

#include "lab/recordings/file_bytes.hpp"
#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

/// The offset of the first record at or after `from` that looks like a chunk (its lengths agree and its compression is known) or like a
/// message (of a channel of `known`, near its times, and with another record behind it).
std::optional<std::uint64_t> find_mcap_record(const FileBytes& file, std::uint64_t from,
                                              const std::map<std::uint32_t, TimesSummary>& known);

}  // namespace kilvo::lab
