// What a robot may have done while its IMU was silent.
#pragma once

#include <algorithm>

#include "kilvo/filter/state.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo {

/// Of a stream: messages that are so many periods apart have one missing between them, whatever the jitter.
inline constexpr double periods_of_a_gap = 2.5;

/// Sweeps or images that have not come for so long, at this rate (Hz), are lost: three periods (theta_s of Eq. 16), but no less than what
/// makes a gap of some frames of a fast sensor.
inline bool is_silence(Duration since, double rate) {
  constexpr Duration least = std::chrono::milliseconds(300);
  constexpr double periods = 3;
  return since > std::max(least, from_seconds(periods / rate));
}

/// Adds to the covariance what a walking robot may have done in the part [begin, end] of a gap of `gap` s.
void inflate_covariance_over_gap(Estimate& e, Time begin, Time end, double gap);

}  // namespace kilvo
