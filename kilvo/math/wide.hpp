// Numbers that are worked on together. Functions that do so are marked KILVO_WIDE (cmake/kilvo_module.cmake): compiled for any processor
// and for those with wide registers.
#pragma once

#include <cstddef>

namespace kilvo {

/// Numbers that are worked on at once, whatever the processor's registers hold: one order of additions everywhere.
inline constexpr std::size_t lanes = 8;
using Lanes = float __attribute__((vector_size(lanes * sizeof(float))));

[[gnu::always_inline]] inline void read_lanes(Lanes& to, const float* from) {
  using Loose = float __attribute__((vector_size(lanes * sizeof(float)), aligned(sizeof(float)), may_alias));
  to = *reinterpret_cast<const Loose*>(from);
}

[[gnu::always_inline]] inline float total(const Lanes& of) {
  return ((of[0] + of[4]) + (of[2] + of[6])) + ((of[1] + of[5]) + (of[3] + of[7]));
}

}  // namespace kilvo
