// The simulated robot as the estimator is told of it: topics and a configuration file.
#pragma once

#include <array>
#include <string>

#include "kilvo/sensors/measurement.hpp"
#include "lab/simulation/simulator_config.hpp"

namespace kilvo::lab {

/// By Sensor.
std::array<std::string, sensor_count> simulated_topics();

/// A configuration file (YAML) for recordings of this robot, with what its clocks are off. `urdf`: path of the URDF, relative to the file.
std::string simulated_config(const SimulatorConfig& config, const std::string& urdf);

}  // namespace kilvo::lab
