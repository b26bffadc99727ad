// Turns the points of a scan, each taken at its own time on the move, into points seen from one pose.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "kilvo/filter/predict.hpp"
#include "kilvo/filter/trajectory.hpp"
#include "kilvo/lidar/own_body.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

/// x, y, z in metres and intensity.
using PointXYZI = Eigen::Vector4f;

/// Points that were not used, by cause.
struct PointDrops {
  std::uint32_t non_finite = 0, at_origin = 0, too_near = 0, too_far = 0, own_body = 0, outside_trajectory = 0;
};

/// A scan's points in the IMU frame of time `at`, by their relative motion along `trajectory`; both ends of the scan and `at` should lie
/// within it. Points without a pose (up to `slack` outside: the end pose) and of the robot's own `body` are dropped and counted.
std::vector<PointXYZI> undistort(const LidarScan& scan, const Trajectory& trajectory, Time at, const LidarMount& mount, PointDrops& drops,
                                 OwnBody* body = nullptr);

/// What the IMU's noise within a scan, seen from its middle, does to its pose (rotation, position), alike for all points.
struct UndistortionNoise {
  PoseCovariance V = PoseCovariance::Zero();  // its covariance
  /// How it goes with the prediction over the first half of the scan, which the same noise has moved: opposite, so negative; and, by its
  /// size, with that over the second half, which has yet to be made.
  PoseCovariance with_prediction = PoseCovariance::Zero();
};
UndistortionNoise undistortion_noise(const ProcessNoise& noise, Duration half_scan);

}  // namespace kilvo
