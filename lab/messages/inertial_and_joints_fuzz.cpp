#include "lab/messages/inertial_and_joints.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const kilvo::lab::Bytes message(data, size);
  (void)kilvo::lab::decode_imu(message);
  (void)kilvo::lab::decode_joint_state(message);
  return 0;
}
