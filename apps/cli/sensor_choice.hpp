// Which sensors are used.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "lab/recordings/recording_source.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/failures.hpp"

namespace kilvo::cli {

/// "imu,lidar" -> sensors. Throws UsageError, naming the nearest, for an unknown one.
std::vector<Sensor> parse_sensors(const std::string& list);

/// "lidar:10-16", "lidar:10-" (to the end). Throws UsageError.
lab::Failure parse_drop(const std::string& text);

/// "dark:10-16", "blank:10-16" (images), "narrow:10-" (scans of 30 degrees), "accel:10-12", "gyro:10-12" (an IMU half of which repeats its
/// last values). Throws UsageError.
lab::Failure parse_degradation(const std::string& text);

/// "camera:50": its messages come 50 ms later. Throws UsageError.
lab::Failure parse_delay(const std::string& text);

/// Adds a sentence about each of the failures that met no message.
void warn_of_no_effect(const lab::FailingSource& failing, const std::vector<Sensor>& used, std::vector<std::string>& out);

struct SensorChoice {
  std::vector<Sensor> used;
  std::vector<std::string> warnings;  // what is configured and not there
};

/// The sensors wanted; without a wish those that are configured and in the input. Throws UsageError for a wish that cannot be fulfilled,
/// InputError when the input has none of the topics configured, or neither legs nor LiDAR where any is configured.
SensorChoice choose_sensors(const std::optional<std::vector<Sensor>>& wanted, const lab::Settings& settings, const std::string& config,
                            const std::vector<std::string>& inputs);

/// How messages name several inputs.
std::string joined(const std::vector<std::string>& inputs);

}  // namespace kilvo::cli
