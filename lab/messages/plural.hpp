// Counts for people to read.
#pragma once

#include <cstdint>
#include <string>

namespace kilvo::lab {

/// "1 message", "2 messages".
inline std::string plural(std::uint64_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace kilvo::lab
