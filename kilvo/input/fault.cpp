#include "kilvo/input/fault.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

std::optional<Reason> when(bool wrong, Reason r) { return wrong ? std::optional(r) : std::nullopt; }

}  // namespace

std::optional<Reason> fault_of(const ImuSample& s) {
  constexpr double absurd_gyro = 300, absurd_accel = 5000;  // rad/s, m/s^2 (or g): beyond any IMU's range
  if (!s.gyro.allFinite() || !s.accel.allFinite()) return Reason::not_finite;
  return when(s.gyro.norm() > absurd_gyro || s.accel.norm() > absurd_accel, Reason::absurd_value);
}

std::optional<Reason> fault_of(const JointSample& s) {
  constexpr double absurd = 100;  // rad or m, rad/s or m/s: no joint goes so far, or so fast
  const auto beyond = [](const std::vector<double>& values) {
    return std::ranges::any_of(values, [](double v) { return std::isfinite(v) && std::abs(v) > absurd; });
  };
  if (s.position.empty()) return Reason::empty;
  return when(beyond(s.position) || beyond(s.velocity), Reason::absurd_value);
}

std::optional<Reason> fault_of(const Measurement& m) {
  if (const auto* scan = std::get_if<LidarScan>(&m)) return when(scan->points.empty(), Reason::empty);
  if (const auto* image = std::get_if<CameraImage>(&m)) return when(image->image.empty(), Reason::empty);
  if (const auto* joints = std::get_if<JointSample>(&m)) return fault_of(*joints);
  const auto* imu = std::get_if<ImuSample>(&m);
  return imu == nullptr ? std::nullopt : fault_of(*imu);
}

}  // namespace kilvo
