// Which sensors carry the estimate (paper, Fig. 2).
#pragma once

#include <cstdint>

namespace kilvo {

enum class Modality : std::uint8_t { kilv, kil, ki, liv, li, coast };

/// As written in files: KILV KIL KI LIV LI COAST.
constexpr const char* name_of(Modality m) {
  constexpr const char* names[] = {"KILV", "KIL", "KI", "LIV", "LI", "COAST"};
  return names[static_cast<int>(m)];
}

constexpr bool has_legs(Modality m) { return m == Modality::kilv || m == Modality::kil || m == Modality::ki; }
constexpr bool has_lidar(Modality m) { return m != Modality::ki && m != Modality::coast; }
constexpr bool has_camera(Modality m) { return m == Modality::kilv || m == Modality::liv; }

/// What is left of it when the legs are lost.
constexpr Modality without_legs(Modality m) {
  if (!has_legs(m)) return m;
  return has_camera(m) ? Modality::liv : has_lidar(m) ? Modality::li : Modality::coast;
}

}  // namespace kilvo
