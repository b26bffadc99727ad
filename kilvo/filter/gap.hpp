// What a robot may have done while its IMU was silent.
#pragma once

#include <algorithm>

#include "kilvo/filter/predict.hpp"
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

/// Moves the estimate to `end` where the IMU did not measure: the body turns at `rate` (rad/s), and its velocity, which wanders about
/// standing still (Ornstein-Uhlenbeck process), is forgotten within seconds. Without what it may have done beyond that
/// (inflate_covariance_over_gap).
void carry_blind(Estimate& e, Time end, const Eigen::Vector3d& rate, const ProcessNoise& noise);

/// Adds to the covariance what a walking robot may have done in the part [begin, end] of a gap of `gap` s.
void inflate_covariance_over_gap(Estimate& e, Time begin, Time end, double gap);

}  // namespace kilvo
