// How long a sensor may be silent.
#pragma once

#include "kilvo/sensors/time.hpp"

namespace kilvo {

/// After an IMU gap longer than this nothing is known of the motion in between but that it was a walking robot's, s.
inline constexpr double blind_gap = 0.1;

/// A sensor that comes often is missed when it has been silent for longer.
inline constexpr Duration least_silence = std::chrono::milliseconds(50);

}  // namespace kilvo
