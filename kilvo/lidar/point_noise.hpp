// Measurement covariance of a LiDAR point: range noise along the beam, bearing noise across it.
#pragma once

#include <Eigen/Core>

#include "kilvo/lidar/lidar_config.hpp"

namespace kilvo {

/// n' C n along a unit vector n of that covariance C, m^2. `beam`: from the LiDAR to the point, m, same frame as n.
inline double point_noise_along(const Eigen::Vector3d& n, const Eigen::Vector3d& beam, const LidarConfig& config) {
  const double range2 = beam.squaredNorm();
  const double cosine2 = n.dot(beam) * n.dot(beam) / range2;
  return config.range_noise * config.range_noise * cosine2 + config.angle_noise * config.angle_noise * range2 * (1 - cosine2);
}

}  // namespace kilvo
