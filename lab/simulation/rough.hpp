// Robots as they are: `kilvo simulate --rough`. What is simulated differs from what its user has written about it.
#pragma once

#include <string>
#include <string_view>

#include "lab/simulation/simulator_config.hpp"

namespace kilvo::lab {

/// What can be rough by itself. Each part draws from a generator of its own: one part alone is the same as among the others.
struct RoughParts {
  bool lidar = true, scene = true, imu = true, legs = true, camera = true, mount = true, time = true;
};

/// Their names, with commas between.
std::string names_of(const RoughParts& parts);

/// From such a list; all of an empty one. Throws std::invalid_argument at a name that is none, with those that there are.
RoughParts rough_parts(std::string_view names);

struct RoughRobot {
  SimulatorConfig truth;  // to be simulated
  SimulatorConfig known;  // to be described
};

/// `level` 0: both are the nominal one; 1: a robot that is kept well; 2: one that is not. The seed is that of `nominal`.
RoughRobot rough_robot(const SimulatorConfig& nominal, int level, const RoughParts& parts);

}  // namespace kilvo::lab
