#include "apps/cli/joint_advice.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "lab/doctor/joint_names.hpp"
#include "lab/settings/leg_joints.hpp"
#include "lab/settings/nearest.hpp"

namespace kilvo::cli {

std::string joint_advice(const Robot& robot, const std::vector<std::string>& message_names) {
  const std::vector<std::string> joints = lab::leg_joints(robot).list();
  if (const auto others = lab::matching_names(joints, message_names); !others.empty()) {
    return fmt::format("{} is {} there: kilvo doctor RECORDING --config FILE --write FILE puts robot.joints into the configuration",
                       others.begin()->first, others.begin()->second);
  }
  for (const std::string& joint : joints) {
    if (message_names.empty() || std::ranges::find(message_names, joint) != message_names.end()) continue;
    return fmt::format(
        "the nearest there is {0}: robot.joints: {{{1}: {{from: {0}}}}} if it is that one, robot.locked_joints if it does not move",
        lab::nearest(joint, message_names), joint);
  }
  return "robot.urdf, or robot.locked_joints";
}

}  // namespace kilvo::cli
