#include "lab/messages/inertial_and_joints.hpp"

#include <gtest/gtest.h>

#include "lab/messages/byte_writer.hpp"
#include "lab/messages/encode.hpp"

namespace kilvo::lab {
namespace inertial_and_joints_test {

const Time stamp = time_from_ns(1'700'000'000'000'000'001);

ImuSample some_imu() { return {stamp, {0.1, -0.2, 0.3}, {0.5, 1.5, -9.81}}; }

JointSample some_joints() { return {stamp, {"left_knee_joint", "right_knee_joint"}, {0.25, -0.5}, {1.5, 2.5}, {30, 40}}; }

TEST(DecodeImu, ReadsTimeAngularRateAndAcceleration) {
  const auto decoded = decode_imu(encode(some_imu(), "imu"));
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_EQ(decoded->t, stamp);
  EXPECT_EQ(decoded->gyro, Eigen::Vector3d(0.1, -0.2, 0.3));
  EXPECT_EQ(decoded->accel, Eigen::Vector3d(0.5, 1.5, -9.81));
}

TEST(DecodeImu, RefusesEveryOtherLength) {
  auto bytes = encode(some_imu(), "imu");
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decode_imu(Bytes(bytes).first(size))) << size;
  bytes.push_back(0);
  const auto decoded = decode_imu(bytes);
  EXPECT_EQ(decoded.reason(), "sensor_msgs/Imu: 1 bytes left over at the end");
}

TEST(DecodeImu, PassesNonFiniteValuesOn) {
  auto sample = some_imu();
  sample.gyro.x() = std::numeric_limits<double>::quiet_NaN();
  const auto decoded = decode_imu(encode(sample, ""));
  ASSERT_TRUE(decoded);
  EXPECT_TRUE(std::isnan(decoded->gyro.x()));
}

TEST(DecodeJointState, ReadsNamesPositionsVelocitiesAndEfforts) {
  const auto decoded = decode_joint_state(encode(some_joints(), "pelvis"));
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_EQ(decoded->t, stamp);
  EXPECT_EQ(decoded->names, some_joints().names);
  EXPECT_EQ(decoded->position, some_joints().position);
  EXPECT_EQ(decoded->velocity, some_joints().velocity);
  EXPECT_EQ(decoded->effort, some_joints().effort);
}

TEST(DecodeJointState, AllowsArraysOfDifferentLengths) {
  const JointSample feet{stamp, {}, {1, 2, 3, 4, 5, 6}, {1, 2}, {}};
  const auto decoded = decode_joint_state(encode(feet, ""));
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_TRUE(decoded->names.empty());
  EXPECT_EQ(decoded->position.size(), 6U);
  EXPECT_EQ(decoded->velocity.size(), 2U);
  EXPECT_TRUE(decoded->effort.empty());
}

TEST(DecodeJointState, RefusesEveryShorterMessage) {
  const auto bytes = encode(some_joints(), "pelvis");
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decode_joint_state(Bytes(bytes).first(size))) << size;
}

TEST(DecodeJointState, RefusesCountsThatTheBytesCannotHold) {
  const auto with_counts = [](std::uint32_t names, std::uint32_t positions) {
    ByteWriter writer;
    writer.put(0U).put_time(stamp).put_string("").put(names).put(positions).put(0U).put(0U);
    return writer.take();
  };
  EXPECT_TRUE(decode_joint_state(with_counts(0, 0)));
  EXPECT_FALSE(decode_joint_state(with_counts(0xFFFFFFFF, 0)));
  EXPECT_FALSE(decode_joint_state(with_counts(0, 0x20000000)));  // times 8 bytes it would be 0 in 32 bits
}

}  // namespace inertial_and_joints_test
}  // namespace kilvo::lab
