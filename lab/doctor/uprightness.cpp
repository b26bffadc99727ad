// The accelerometer against the legs: a robot that walks is upright.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {

// From the feet to the hips, of any length.
Eigen::Vector3d Examination::up_by_legs() const {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const LegPose& pose : legs_under(nullptr)) {
    if (!stepping_.bears(pose.t)) continue;
    for (const FootPose& foot : pose.foot) up -= foot.p[0];
  }
  return up;
}

// Degrees between gravity by the accelerometer and the direction from the feet to the hips, the least of three parts of the recording: what
// impacts add, sampled without a filter, differs from part to part.
std::optional<double> Examination::tilt_under(const SO3& R_link_imu, bool only_calm) const {
  constexpr std::size_t parts = 3;
  const Eigen::Vector3d up = up_by_legs();
  if (!(up.norm() > 0)) return std::nullopt;
  double least = 180;
  std::vector<const InertialSample*> samples;
  for (const InertialSample& s : recorded_.imu) {
    if (stepping_.bears(s.t)) samples.push_back(&s);
  }
  const std::size_t n = samples.size() / parts;
  if (n == 0) return std::nullopt;
  for (std::size_t part = 0; part < parts; ++part) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (std::size_t i = part * n; i < (part + 1) * n; ++i) force += accel_axes_ * samples[i]->accel / static_cast<double>(n);
    if (only_calm && std::abs(force.norm() / gravity - 1) > 0.1) return std::nullopt;
    const Eigen::Vector3d up_link = R_link_imu * force.normalized();
    least = std::min(least, degrees(std::acos(std::clamp(up_link.dot(up.normalized()), -1.0, 1.0))));
  }
  return least;
}

// Without a LiDAR the accelerometer, and without legs that turn as the gyro does the IMU's mount, has only the robot's uprightness to be
// held against.
void Examination::examine_upright() {
  if (recorded_.legs.empty() || robot_.legs.type != "joints" || (lidar_.known && legs_.known)) return;
  const std::optional<double> tilt = tilt_under(robot_.imu.T_link_imu.R, true);
  if (!tilt) return;
  const double angle = *tilt;
  const std::string detail = fmt::format("gravity by the accelerometer is {:.0f} degrees from where the feet are", angle);
  if (angle < most_tilt) {
    check(Sensor::imu, "uprightness", Check::Verdict::good, detail);
    diagnosis_.checks.back().at_rest = true;
    return;
  }
  const bool turned =
      std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "imu_mount_rotation" || f.cause == "imu_axes"; });
  if (turned) return;
  find({Sensor::imu,
        legs_.known && legs_.agrees ? "imu_axes" : "imu_mount_rotation",
        legs_.known && legs_.agrees ? "the accelerometer's axes are not those of the gyro" : "the IMU is not mounted as described",
        detail,
        "imu.T_link_imu.R, or the axes in the driver",
        angle,
        "deg",
        {},
        true});
}

}  // namespace kilvo::lab
