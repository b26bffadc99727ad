// Which sensors carry the estimate (paper, Fig. 2), and what follows from that.
#pragma once

#include <array>
#include <cstdint>

namespace kilvo {

enum class Modality : std::uint8_t { kilv, kil, ki, liv, li, coast };

struct ModalityRow {
  Modality modality;
  const char* name;  // as written in files
  bool legs, lidar, camera;
  /// The height of the feet over the map's ground is a measurement. With a LiDAR it adds no information.
  bool ground_is_measured;
};

/// By Modality.
inline constexpr std::array modalities = {
    ModalityRow{Modality::kilv, "KILV", true, true, true, false}, ModalityRow{Modality::kil, "KIL", true, true, false, false},
    ModalityRow{Modality::ki, "KI", true, false, false, true},    ModalityRow{Modality::liv, "LIV", false, true, true, false},
    ModalityRow{Modality::li, "LI", false, true, false, false},   ModalityRow{Modality::coast, "COAST", false, false, false, false},
};

constexpr const ModalityRow& row_of(Modality m) { return modalities[static_cast<std::size_t>(m)]; }
constexpr const char* name_of(Modality m) { return row_of(m).name; }
constexpr bool has_legs(Modality m) { return row_of(m).legs; }
constexpr bool has_lidar(Modality m) { return row_of(m).lidar; }
constexpr bool has_camera(Modality m) { return row_of(m).camera; }

/// Of the sensors that can be used. Vision needs the surfaces that the LiDAR sees: a camera without one counts as none.
constexpr Modality modality_of(bool legs, bool lidar, bool camera) {
  for (const ModalityRow& row : modalities) {
    if (row.legs == legs && row.lidar == lidar && row.camera == (camera && lidar)) return row.modality;
  }
  return Modality::coast;
}

static_assert([] {
  for (std::size_t i = 0; i < modalities.size(); ++i) {
    if (modalities[i].modality != static_cast<Modality>(i)) return false;
  }
  return true;
}());

}  // namespace kilvo
