// After how long without a message a sensor counts as lost.
#pragma once

#include <algorithm>

#include "kilvo/sensors/time.hpp"

namespace kilvo {

/// theta_s of Eq. 16: so many periods, but no less than `least`.
inline Duration silence(double rate, double periods, Duration least) { return std::max(least, from_seconds(periods / rate)); }

/// Of the leg messages.
inline Duration silence_of_legs(double rate) { return silence(rate, 5, std::chrono::milliseconds(50)); }

/// While the legs are used their samples carry the outputs, unless one comes so late that the IMU's must. `period`: the last one, s.
inline bool are_legs_overdue(Duration since_last, double rate, double period) {
  constexpr double overdue = 2.5;  // periods
  return since_last >= std::max(from_seconds(overdue / rate), from_seconds(overdue * period));
}

/// Legs without an IMU for longer than this are no odometry, s. `rate`: of the IMU.
inline double longest_held_imu(double rate) { return std::max(0.1, 5 / rate); }

}  // namespace kilvo
