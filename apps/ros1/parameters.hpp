// What the node is told by its private ROS parameters. What the robot is and how it is estimated stands in the configuration file alone.
#pragma once

#include <ros/node_handle.h>
#include <stdexcept>
#include <string>
#include <vector>

namespace kilvo::ros1 {

/// A parameter that cannot be used; the text names it.
struct ParameterError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// How topics and frames are called. The first ones: of the best estimate; `smooth`: of the one without steps.
struct Names {
  std::string map_frame = "map";    // the best estimate's world: corrections are steps
  std::string odom_frame = "odom";  // the smooth one's (REP 105)
  std::string base_frame = "base_link";
  std::string odometry = "~odometry", smooth = "~odometry_smooth", path = "~path", cloud = "~cloud", coloured = "~cloud_coloured",
              contacts = "~contacts", ground = "~ground";
};

struct Parameters {
  std::string config;                  // the configuration file
  std::vector<std::string> overrides;  // KEY=VALUE, as `kilvo run --set`
  Names names;
  bool base_is_link = false;  // the base is the URDF link that imu.T_link_imu names; false: the IMU itself
  bool no_deskew = false;     // as `kilvo run --no-deskew`
  double tf_rate = 100;       // Hz at most
  std::string map_file;       // where ~save_map writes
};

/// Throws ParameterError: one missing, unknown, of a wrong type or out of its range.
Parameters read_parameters(const ros::NodeHandle& own);

}  // namespace kilvo::ros1
