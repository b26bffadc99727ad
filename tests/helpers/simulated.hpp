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

inline std::vector<Measurement> all_of(lab::Simulator& simulator) {
  std::vector<Measurement> out;
  while (auto m = simulator.next()) out.push_back(*std::move(m));
  return out;
}

}  // namespace kilvo::test
