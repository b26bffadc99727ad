// Indicators of how much information a sweep or an image has: one number each, and whether it is too small.
#pragma once

#include <span>
#include <vector>

#include "kilvo/lidar/point_to_plane.hpp"
#include "kilvo/lidar/undistort.hpp"

namespace kilvo {

struct Indicator {
  const char* name = "";
  double value = 0;
  bool degraded = false;  // as it was decided: a direction was not updated, the patches did not carry the estimate
};

/// How flat the cloud is (paper, Section IV-E): smallest eigenvalue of the points' scatter over the largest.
double eigenvalue_ratio(std::span<const PointXYZI> points);

/// Of a sweep: `lidar_ratio`, the shape of the cloud; `lidar_share`, what the registration knows along the direction that it knows least.
std::vector<Indicator> indicators_of(std::span<const PointXYZI> points, const RegistrationReport& report);

/// Of an image: `visual_points`, the points of the map that it shows as they were.
std::vector<Indicator> indicators_of(int visual_points, bool carries);

}  // namespace kilvo
