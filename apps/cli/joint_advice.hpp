// What to do where the messages lack a joint of the legs.
#pragma once

#include <string>
#include <vector>

#include "kilvo/sensors/robot.hpp"

namespace kilvo::cli {

/// The setting under which messages with these names fit, or the nearest name for the first that is missing, for the user.
std::string joint_advice(const Robot& robot, const std::vector<std::string>& message_names);

}  // namespace kilvo::cli
