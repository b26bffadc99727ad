// The topics of the node in ROS 1. What is sent is encoded already.
#pragma once

#include <array>
#include <ros/node_handle.h>

#include "apps/node/outlet.hpp"
#include "apps/ros1/parameters.hpp"

namespace kilvo::ros1 {

class RosOutlet {
 public:
  explicit RosOutlet(const Names& names);

  /// It must outlive what is returned.
  node::Outlet outlet() const;

 private:
  std::array<ros::Publisher, node::topic_count> publishers_;
};

}  // namespace kilvo::ros1
