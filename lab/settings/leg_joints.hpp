// Which joints the messages of the legs must have.
#pragma once

#include "kilvo/sensors/joint_names.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo::lab {

/// Those between the IMU and the feet that are not locked, as the messages name them (robot.joints). None when the messages hold feet
/// instead (legs.type), or the URDF cannot tell.
JointNames leg_joints(const Robot& robot);

}  // namespace kilvo::lab
