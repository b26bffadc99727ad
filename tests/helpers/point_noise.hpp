// The covariance of a LiDAR point, as the model has it.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "kilvo/lidar/lidar_config.hpp"

namespace kilvo::test {

/// `beam`: from the LiDAR to the point, m; the covariance (m^2) is in the same frame.
inline Eigen::Matrix3d point_noise(const Eigen::Vector3d& beam, const LidarConfig& config) {
  const double across = std::pow(config.angle_noise * beam.norm(), 2), along = std::pow(config.range_noise, 2);
  const Eigen::Vector3d b = beam.normalized();
  return across * Eigen::Matrix3d::Identity() + (along - across) * b * b.transpose();
}

}  // namespace kilvo::test
