#include "lab/settings/leg_joints.hpp"

#include <algorithm>
#include <stdexcept>

#include "kilvo/legs/joint_chain.hpp"

namespace kilvo::lab {

JointNames leg_joints(const Robot& robot) {
  if (robot.legs.type != "joints" || robot.urdf.empty()) return {};
  JointNames::List out;
  try {
    const LinkTree tree(robot);
    for (const Foot& foot : robot.feet) {
      // The waist is on the way to both.
      for (const std::string& joint : tree.chain(robot.imu.link, foot.link).names) {
        if (std::ranges::find(out, joint) == out.end()) out.push_back(joint);
      }
    }
  } catch (const std::invalid_argument&) {
    return {};  // the estimator says what is wrong with it
  }
  return out;
}

}  // namespace kilvo::lab
