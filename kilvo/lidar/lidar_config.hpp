// Settings of the LiDAR measurement.
#pragma once

#include <Eigen/Core>
#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo {

struct LidarConfig {
  double range_noise = 0.02;   // m
  double angle_noise = 0.001;  // rad
  double voxel_size = 0.25;    // m
  double gate = 3.0;
  double weak_share = 0.002;
  bool mount_error = true;

  /// How far noise carries points of a surface beyond a voxel's face, m.
  double reach() const { return 3 * range_noise; }

  static constexpr auto fields() {
    return std::tuple{
        Field{"range_noise", &LidarConfig::range_noise, "m", "standard deviation of a measured range; surfaces that look thicker raise it"},
        Field{"angle_noise", &LidarConfig::angle_noise, "rad", "standard deviation of one beam's direction, each way"},
        Field{"voxel_size", &LidarConfig::voxel_size, "m",
              "points of a sweep in one cell of this size become one row that weighs as much as they do; at most a quarter "
              "of map.voxel_size"},
        Field{"gate", &LidarConfig::gate, "sigma", "rows farther from their plane than this are not used"},
        Field{"weak_share", &LidarConfig::weak_share, "-",
              "a direction with less than this share of a sweep's information on position is left to legs and images"},
        Field{"mount_error", &LidarConfig::mount_error, "-",
              "reported sigmas allow for a LiDAR that is not mounted quite as described; false: the mount is known exactly"}};
  }
};

/// Of a point, range noise along the beam and bearing noise across it: n' C n along a unit vector n, m^2. `beam`: to it, m, in n's frame.
inline double point_noise_along(const Eigen::Vector3d& n, const Eigen::Vector3d& beam, const LidarConfig& config) {
  const double range2 = beam.squaredNorm(), cosine2 = n.dot(beam) * n.dot(beam) / range2;
  return config.range_noise * config.range_noise * cosine2 + config.angle_noise * config.angle_noise * range2 * (1 - cosine2);
}

}  // namespace kilvo
