#include "lab/messages/inertial_and_joints.hpp"

#include <algorithm>

#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_reader.hpp"

namespace kilvo::lab {

Decoded<ImuSample> decode_imu(const WireMessage& message) {
  const auto m = read_message<ImuMessage>(message);
  if (!m) return DecodeError{m.reason()};
  const auto& w = m->angular_velocity;
  const auto& a = m->linear_acceleration;
  return ImuSample{m->header.stamp, {w.x, w.y, w.z}, {a.x, a.y, a.z}};
}

Decoded<JointSample> decode_joint_state(const WireMessage& message, const JointNames& known) {
  const auto m = read_message<JointStateMessage>(message);
  if (!m) return DecodeError{m.reason()};
  const bool same = std::ranges::equal(m->names, known);
  return JointSample{m->header.stamp, same ? known : JointNames(JointNames::List(m->names.begin(), m->names.end())), m->position.values(),
                     m->velocity.values(), m->effort.values()};
}

}  // namespace kilvo::lab
