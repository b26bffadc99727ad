// Points as sensor_msgs/PointCloud2.
#pragma once

#include <span>
#include <string>

#include "apps/ros1/ros_messages.hpp"
#include "kilvo/estimator/output.hpp"

namespace kilvo::ros1 {

/// x, y, z (m) and intensity.
CloudMessage cloud_message(std::span<const PointXYZI> points, Time t, const std::string& frame);

/// x, y, z (m) and rgb, packed as RViz and PCL read it.
CloudMessage cloud_message(std::span<const ColouredPoint> points, Time t, const std::string& frame);

}  // namespace kilvo::ros1
