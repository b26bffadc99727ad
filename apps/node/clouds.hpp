// Points as sensor_msgs/PointCloud2.
#pragma once

#include <span>
#include <string>

#include "apps/node/output_messages.hpp"
#include "kilvo/estimator/output.hpp"

namespace kilvo::node {

/// x, y, z (m) and intensity.
PointCloud cloud_message(std::span<const PointXYZI> points, Time t, const std::string& frame);

/// x, y, z (m) and rgb, packed as RViz and PCL read it.
PointCloud cloud_message(std::span<const ColouredPoint> points, Time t, const std::string& frame);

}  // namespace kilvo::node
