// The two small, fast messages: sensor_msgs/Imu and sensor_msgs/JointState.
#pragma once

#include "kilvo/sensors/measurement.hpp"
#include "lab/messages/decoded.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// sensor_msgs/Imu. Orientation and covariances are not used. Values are passed on as they are, finite or not.
Decoded<ImuSample> decode_imu(const WireMessage& message);

/// sensor_msgs/JointState. The four arrays may have any lengths; whether they agree is for the estimator to judge. `known`: names
/// that messages before had, so that one with the same need not hold them again.
Decoded<JointSample> decode_joint_state(const WireMessage& message, const JointNames& known = {});

}  // namespace kilvo::lab
