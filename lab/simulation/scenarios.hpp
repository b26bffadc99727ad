// The walks that can be simulated, by name.
#pragma once

#include <string>
#include <vector>

#include "lab/simulation/footsteps.hpp"

namespace kilvo::lab {

struct Scenario {
  std::string name;
  std::string sentence;  // for the user
  std::string world;     // of make_scene()
  Place start;
  std::vector<Stage> stages;
  double lidar_range = 0;  // m; 0: the sensor's own
};

const std::vector<Scenario>& scenarios();

}  // namespace kilvo::lab
