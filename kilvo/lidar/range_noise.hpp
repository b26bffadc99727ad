// How much the ranges of this LiDAR scatter, from how thick its sweeps see surfaces. A described noise that is too small makes walls look
// rough: they are split into small planes or make none, and the map wanders.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "kilvo/lidar/downsample.hpp"
#include "kilvo/lidar/lidar_config.hpp"

namespace kilvo {

class RangeNoise {
 public:
  /// The clusters of one sweep, in the IMU frame, in which the LiDAR is at p_IL. Of `config` the angle noise is used.
  void add(std::span<const PointCluster> clusters, const Eigen::Vector3d& p_IL, const LidarConfig& config);

  /// Standard deviation of one range, m: at least the described one.
  double sigma(double described) const;

 private:
  double variance_ = 0;       // m^2; 0: not known
  double weight_ = 0;         // sweeps
  std::vector<double> seen_;  // m^2, of each cluster
};

}  // namespace kilvo
