// The walks that can be simulated, by name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lab/simulation/footsteps.hpp"
#include "lab/simulation/simulator_config.hpp"

namespace kilvo::lab {

struct Scenario {
  std::string name;
  std::string sentence;  // for the user
  std::string world;     // of make_scene()
  Place start;
  std::vector<Stage> stages;
  double lidar_range = 0;             // m; 0: the sensor's own
  WearModel wear{};                   // of its robot
  double leg_rate = 0, imu_rate = 0;  // Hz; 0: the sensors' own
  std::string also{};                 // another name, as recordings of the same kind have it
};

const std::vector<Scenario>& scenarios();

/// By either of its names; nullptr when there is none.
const Scenario* find_scenario(std::string_view name);

/// The robot of a scenario: its wear and the rates of its sensors.
SimulatorConfig robot_of(const Scenario& scenario);

}  // namespace kilvo::lab
