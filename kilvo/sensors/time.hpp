// Time is int64 nanoseconds of a clock that has no now(): the estimator cannot ask what time it is; time comes from data only.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace kilvo {

struct SensorClock {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = std::chrono::duration<rep, period>;
  using time_point = std::chrono::time_point<SensorClock>;
  static constexpr bool is_steady = true;
};

using Duration = SensorClock::duration;
using Time = SensorClock::time_point;

constexpr double to_seconds(Duration d) { return static_cast<double>(d.count()) * 1e-9; }

/// Rounded to the nearest nanosecond; `s` must be finite and below 292 years.
inline Duration from_seconds(double s) { return Duration(std::llround(s * 1e9)); }

constexpr Time time_from_ns(std::int64_t ns) { return Time(Duration(ns)); }
constexpr std::int64_t to_ns(Time t) { return t.time_since_epoch().count(); }

/// After an IMU gap longer than this nothing is known of the motion in between but that it was a walking robot's, s.
inline constexpr double blind_gap = 0.1;
/// A sensor that comes often is missed when it has been silent for longer.
inline constexpr Duration least_silence = std::chrono::milliseconds(50);

}  // namespace kilvo
