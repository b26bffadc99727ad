// What tests of the simulator have in common.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "lab/simulation/simulator.hpp"

namespace kilvo::test {

inline const lab::Scenario& scenario(const std::string& name) { return *std::ranges::find(lab::scenarios(), name, &lab::Scenario::name); }

inline lab::SimulatorConfig only(std::initializer_list<Sensor> sensors, double duration) {
  lab::SimulatorConfig config;
  config.use.fill(false);
  for (const Sensor s : sensors) config.use[static_cast<std::size_t>(s)] = true;
  config.duration = duration;
  return config;
}

/// Small images, few points: quick.
inline lab::SimulatorConfig small(double duration) {
  lab::SimulatorConfig config;
  config.duration = duration;
  config.lidar.points = 1000;
  config.camera.width = 80;
  config.camera.height = 60;
  return config;
}

/// IMU, LiDAR and a camera of half the usual size.
inline lab::SimulatorConfig seen_by_half_a_camera(double duration, int points) {
  lab::SimulatorConfig config = only({Sensor::imu, Sensor::lidar, Sensor::camera}, duration);
  config.threads = 2;
  config.lidar.points = points;
  config.camera.width = 320;
  config.camera.height = 240;
  config.camera.fx = config.camera.fy = 170.6;
  config.camera.cx = 160.4;
  config.camera.cy = 118.8;
  return config;
}

inline std::vector<Measurement> all_of(lab::Simulator& simulator) {
  std::vector<Measurement> out;
  while (auto m = simulator.next()) out.push_back(*std::move(m));
  return out;
}

}  // namespace kilvo::test
