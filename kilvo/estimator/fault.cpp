#include "kilvo/estimator/fault.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {

const char* fault_of(const ImuSample& s) {
  constexpr double absurd_gyro = 300, absurd_accel = 5000;  // rad/s, m/s^2 (or g): beyond any IMU's range
  if (!s.gyro.allFinite() || !s.accel.allFinite()) return "not finite";
  return s.gyro.norm() > absurd_gyro || s.accel.norm() > absurd_accel ? "absurd value" : nullptr;
}

const char* fault_of(const JointSample& s) {
  constexpr double absurd_position = 100, absurd_velocity = 100;  // rad or m, rad/s or m/s: no joint turns so fast
  const auto beyond = [](const std::vector<double>& values, double limit) {
    return std::ranges::any_of(values, [limit](double v) { return std::isfinite(v) && std::abs(v) > limit; });
  };
  if (s.position.empty()) return "empty";
  return beyond(s.position, absurd_position) || beyond(s.velocity, absurd_velocity) ? "absurd value" : nullptr;
}

const char* fault_of(const LidarScan& s) { return s.points.empty() ? "empty" : nullptr; }

const char* fault_of(const CameraImage& s) { return s.image.empty() ? "empty" : nullptr; }

}  // namespace kilvo
