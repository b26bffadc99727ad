// What a node is told beside the configuration file: names, and which part of the robot its poses are of.
#pragma once

#include <string>

namespace kilvo::node {

struct Options {
  std::string config;               // the configuration file, for messages
  std::string map_frame = "map";    // the best estimate's world: corrections are steps
  std::string odom_frame = "odom";  // the smooth one's (REP 105)
  /// The part of the robot that the odometry is of: `imu`, `link` (the one that imu.T_link_imu names) or any link of the URDF. Empty: the
  /// root of the URDF if its place against the IMU is rigid or measured, else the IMU.
  std::string base;
  std::string base_frame;                  // its name; empty: the link's, or base_link for the IMU
  bool no_deskew = false;                  // as `kilvo run --no-deskew`
  double tf_rate = 100;                    // Hz at most
  std::string map_file = "kilvo_map.ply";  // where save_map writes
};

}  // namespace kilvo::node
