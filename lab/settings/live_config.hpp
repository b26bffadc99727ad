// Settings of the live runner (apps/live).
#pragma once

#include <string>
#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo::lab {

struct LiveConfig {
  double max_latency = 0.2;  // s
  int priority = -1;
  int fast_core = -1;
  int slow_core = -1;
  std::string name = "kilvo";
  std::string map_frame = "map", odom_frame = "odom";
  std::string base, base_frame;
  double tf_rate = 100;  // Hz
  std::string map_file = "kilvo_map.ply";

  static constexpr auto fields() {
    return std::tuple{
        Field{"max_latency", &LiveConfig::max_latency, "s",
              "leg samples that have waited longer, because the machine is too slow, are given up"},
        Field{"priority", &LiveConfig::priority, "-",
              "real-time priority (SCHED_FIFO, 1 to 99) of the thread that answers the legs; 0: none; -1: the lowest, where the "
              "system allows it"},
        Field{"fast_core", &LiveConfig::fast_core, "-", "the core for the thread that answers the legs; -1: any"},
        Field{"slow_core", &LiveConfig::slow_core, "-", "the core for the thread that works on sweeps and images; -1: any"},
        Field{"name", &LiveConfig::name, "-", "kilvo live: name of the node, the first part of the names of its topics and services"},
        Field{"map_frame", &LiveConfig::map_frame, "-", "kilvo live: frame of the best estimate, whose corrections are steps"},
        Field{"odom_frame", &LiveConfig::odom_frame, "-", "kilvo live: frame of the smooth estimate, which has no steps"},
        Field{
            "base", &LiveConfig::base, "-",
            "kilvo live: what the odometry is of: imu, link (that of imu.T_link_imu) or any link of the URDF; empty: the root of the URDF "
            "if its joints up to the IMU are locked or measured, else the IMU"},
        Field{"base_frame", &LiveConfig::base_frame, "-", "kilvo live: frame of the base; empty: its link's name, base_link for the IMU"},
        Field{"tf_rate", &LiveConfig::tf_rate, "Hz", "kilvo live: largest rate of the transforms"},
        Field{"map_file", &LiveConfig::map_file, "-", "kilvo live: where the service save_map writes"}};
  }
};

}  // namespace kilvo::lab
