// Measurement covariance of a LiDAR point: range noise along the beam, bearing noise across it.
#pragma once

#include <Eigen/Core>

#include "kilvo/lidar/lidar_config.hpp"

namespace kilvo {

/// `beam`: from the LiDAR to the point, m, any frame; the covariance (m^2) is in the same frame.
inline Eigen::Matrix3d point_noise(const Eigen::Vector3d& beam, const LidarConfig& config) {
  const double range2 = beam.squaredNorm();
  const double across = config.angle_noise * config.angle_noise * range2;
  const double along = config.range_noise * config.range_noise;
  return across * Eigen::Matrix3d::Identity() + ((along - across) / range2) * beam * beam.transpose();
}

/// n' C n of the same covariance, without building it.
inline double point_noise_along(const Eigen::Vector3d& n, const Eigen::Vector3d& beam, const LidarConfig& config) {
  const double range2 = beam.squaredNorm();
  const double cosine2 = n.dot(beam) * n.dot(beam) / range2;
  return config.range_noise * config.range_noise * cosine2 + config.angle_noise * config.angle_noise * range2 * (1 - cosine2);
}

}  // namespace kilvo
