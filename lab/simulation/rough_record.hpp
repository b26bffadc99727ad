// What `--rough` has done, for those who compare with it.
#pragma once

#include <string>

#include "lab/simulation/rough.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {

/// The true values that have no setting (YAML); those that have one are what simulated_config() says of the simulator's robot.
std::string rough_record(int level, const RoughParts& parts, const Simulator& simulator);

}  // namespace kilvo::lab
