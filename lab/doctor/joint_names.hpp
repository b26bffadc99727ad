// Joints that the messages name in another style than the URDF does.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace kilvo::lab {

/// Of each joint that is not in the messages the name there that has the same words, in any order and style: left_knee_joint is LeftKnee,
/// l_knee or robot/left_knee_joint. Empty where one has no such name, or several.
std::map<std::string, std::string> matching_names(const std::vector<std::string>& joints, const std::vector<std::string>& message_names);

}  // namespace kilvo::lab
