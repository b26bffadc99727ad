// Which senses run (paper, Fig. 2).
#pragma once

#include <cstdint>

namespace kilvo {

enum class Modality : std::uint8_t { kilv, kil, ki, liv, li, coast };

/// As written in files: KILV KIL KI LIV LI COAST.
constexpr const char* name_of(Modality m) {
  constexpr const char* names[] = {"KILV", "KIL", "KI", "LIV", "LI", "COAST"};
  return names[static_cast<int>(m)];
}

}  // namespace kilvo
