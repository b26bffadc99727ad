// From settings to an estimator.
#pragma once

#include <array>
#include <vector>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::cli {

/// By Sensor, whether it is in the list.
std::array<bool, sensor_count> as_flags(const std::vector<Sensor>& sensors);

/// Throws lab::ConfigError when the settings, or what the URDF says, make no sense.
Estimator make_estimator(const lab::Settings& settings, const std::vector<Sensor>& used);

/// What is not given in `settings`, for so many threads; `live`: on a robot.
void fit_to_machine(lab::Settings& settings, bool live, int threads);

}  // namespace kilvo::cli
