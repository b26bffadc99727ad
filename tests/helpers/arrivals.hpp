// What the sensors of a robot send, by the clocks that they have, and what SensorClocks make of it.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "lab/clocks/sensor_clocks.hpp"

namespace kilvo::lab::test_arrivals {

using std::chrono::milliseconds;
using std::chrono::seconds;

inline const Time day = time_from_ns(1'700'000'000'000'000'000);
inline const Duration to_uptime = time_from_ns(1'000'000'000'000) - day;

/// What the sensors measure during `length`, in the order of arrival: IMU at 200 Hz, legs at 500 Hz, sweeps of 100 ms, images at 10 Hz,
/// each with its own delay and jitter.
struct Robot {
  std::array<Duration, sensor_count> clock{};  // added to the stamps
  std::array<Duration, sensor_count> delay{milliseconds(1), milliseconds(2), milliseconds(12), milliseconds(40)};
  std::array<Duration, sensor_count> begin{};  // after the first
  Duration length = seconds(3);

  struct Arrival {
    Measurement m;
    Time at, measured;
  };
  std::vector<Arrival> arrivals() const {
    std::vector<Arrival> out;
    for (const Sensor s : all_sensors) {
      const std::size_t i = index_of(s);
      const Duration period = milliseconds(std::array{5, 2, 100, 100}[i]);
      int n = 0;
      for (Time t = day + begin[i]; t < day + length; t += period) {
        const Duration jitter = milliseconds(++n % 4);
        const Time end = s == Sensor::lidar ? t + milliseconds(99) : t;
        out.push_back({measurement(s, t + clock[i]), end + delay[i] + jitter, t});
      }
    }
    std::ranges::stable_sort(out, {}, &Arrival::at);
    return out;
  }
  static Measurement measurement(Sensor s, Time t) {
    switch (s) {
      case Sensor::imu:
        return ImuSample{t};
      case Sensor::legs:
        return JointSample{t, {}, {0}, {}, {}};
      case Sensor::lidar:
        return LidarScan{t, {{1, 0, 0, 0, 0}, {1, 0, 0, 0, 99'000'000}}};
      case Sensor::camera:
        break;
    }
    return CameraImage{t, {}};
  }
};

/// Of all that is given out: the largest difference between a stamp and the time of measurement by the IMU's clock, s; and how many waited.
struct Result {
  std::array<double, sensor_count> worst{}, least{};
  std::array<int, sensor_count> withheld{}, given{};
};

inline Result result_of(SensorClocks& clocks, const std::vector<Robot::Arrival>& arrivals, Duration imu_clock) {
  Result out;
  for (const auto& a : arrivals) {
    Measurement m = a.m;
    const std::size_t i = m.index();
    clocks.note(m, a.at);
    if (!clocks.knows(sensor_of(m))) {
      ++out.withheld[i];
      continue;
    }
    clocks.correct(m, a.at);
    const double error = to_seconds(stamp_of(m) - (a.measured + imu_clock));
    out.worst[i] = out.given[i] == 0 ? error : std::max(out.worst[i], error);
    out.least[i] = out.given[i]++ == 0 ? error : std::min(out.least[i], error);
  }
  return out;
}

inline Result result_of(const Robot& robot) {
  SensorClocks clocks;
  return result_of(clocks, robot.arrivals(), robot.clock[0]);
}

}  // namespace kilvo::lab::test_arrivals
