#include "lab/messages/unitree.hpp"

#include <gmock/gmock.h>

#include "lab/messages/message_decoder.hpp"
#include "lab/messages/tiny_low_state.hpp"

namespace kilvo::lab {
namespace unitree_test {

using testing::HasSubstr;

std::vector<std::uint8_t> bytes_of(const HgLowStateMessage& m) { return write_message(m, Encoding::cdr); }

Decoded<UnitreeSample> decode(const HgLowStateMessage& m) { return decode_hg_low_state({bytes_of(m), Encoding::cdr}); }

TEST(LowState, GivesTheImuAndTheJointsByName) {
  const auto sample = decode(tiny_low_state());
  ASSERT_TRUE(sample) << sample.reason();
  EXPECT_EQ(sample->imu.gyro, Eigen::Vector3d(0.125, -0.25, 0.5));
  EXPECT_EQ(sample->imu.accel, Eigen::Vector3d(0.5, -0.75, 9.75));
  EXPECT_EQ(sample->tick, 123456U);
  ASSERT_TRUE(sample->joints) << sample->joints.reason();
  const JointSample& joints = *sample->joints;
  ASSERT_EQ(joints.names.size(), 29U);
  EXPECT_EQ(joints.names[9], "right_knee_joint");
  EXPECT_EQ(joints.position[9], 9 * 0.0625);
  EXPECT_EQ(joints.velocity[9], -9 * 0.125);
  EXPECT_EQ(joints.effort[9], 4.5);
  EXPECT_EQ(joints.names[28], "right_wrist_yaw_joint");
  EXPECT_EQ(joints.t, time_from_ns(123'456'000'000)) << "the counter: milliseconds since the robot was switched on";
}

TEST(LowState, LiesAsTheWireHasIt) {
  // Version 8 bytes, modes 2, padding 2, tick 4, IMU 54, motors of 54 (the first, behind two bytes of padding less) and 56, and so on.
  const auto bytes = bytes_of(tiny_low_state());
  EXPECT_EQ(bytes.size(), 4U + 2088U);
  EXPECT_EQ(bytes[4 + 9], 5) << "mode_machine";
  float angle = 0;
  std::memcpy(&angle, bytes.data() + 4 + 128 + 56 * 2, sizeof angle);
  EXPECT_EQ(angle, 3 * 0.0625F) << "of the fourth motor";
}

TEST(LowState, TheChecksumIsThatOfTheStructInMemory) {
  // The expected number was computed bit by bit over Python's struct.pack('<2I2B2xI13fh2x' + 'B3x4f2hf7I' * 35 + '40B5I').
  HgLowStateMessage m = tiny_low_state();
  EXPECT_EQ(*hg_low_state_crc({bytes_of(m), Encoding::cdr}), 0x66ee5dU);
  EXPECT_EQ(unitree_crc(std::vector<std::uint8_t>{'1', '2', '3', '4', '5', '6', '7', '8'}), 0xfefc54f9U);
  m.crc = 0x66ee5dU;
  EXPECT_TRUE(decode(m));
  m.motor_state[3].q += 0.001F;
  EXPECT_EQ(decode(m).reason(), "unitree_hg/LowState: the checksum is wrong");
}

TEST(LowState, TheRobotSaysWhichJointsItHas) {
  HgLowStateMessage m = tiny_low_state();
  const auto joints = [&m](std::uint8_t mode_machine) {
    m.mode_machine = mode_machine;
    return decode(m)->joints;
  };
  EXPECT_EQ(joints(4)->names.size(), 23U);
  EXPECT_EQ(joints(4)->names[13], "left_shoulder_pitch_joint");
  EXPECT_EQ(joints(4)->position[13], 15 * 0.0625);
  EXPECT_EQ(joints(5)->names.size(), 29U);
  EXPECT_EQ(joints(0)->names.size(), 29U);
  EXPECT_EQ(joints(6)->names.size(), 27U);
  EXPECT_THAT(joints(9).reason(), HasSubstr("mode_machine 9"));
  m.motor_state[27].q = m.motor_state[28].q = 0;
  EXPECT_THAT(joints(6).reason(), HasSubstr("mode_machine 6")) << "an H1-2: 27 motors, in another order";
}

TEST(LowState, AnglesOfMotorsAreRefusedAndTheImuIsNot) {
  HgLowStateMessage m = tiny_low_state();
  m.mode_pr = 1;
  const auto sample = decode(m);
  ASSERT_TRUE(sample);
  EXPECT_THAT(sample->joints.reason(), HasSubstr("mode_pr is 1"));
  const auto bytes = bytes_of(m);
  EXPECT_TRUE(decode_measurement(Sensor::imu, "unitree_hg/LowState", {bytes, Encoding::cdr}, {}));
  EXPECT_FALSE(decode_measurement(Sensor::legs, "unitree_hg/LowState", {bytes, Encoding::cdr}, {}));
}

TEST(LowState, OneMessageIsOfTwoSensorsAndHasATick) {
  const auto bytes = bytes_of(tiny_low_state());
  for (const Sensor sensor : sensors_of_type("unitree_hg/LowState")) {
    const auto decoded = decode_measurement(sensor, "unitree_hg/LowState", {bytes, Encoding::cdr}, {});
    ASSERT_TRUE(decoded) << decoded.reason();
    EXPECT_EQ(sensor_of(decoded->measurement), sensor);
    EXPECT_EQ(decoded->tick, 123456U);
  }
}

TEST(LowState, EveryShorterMessageIsRefused) {
  const auto bytes = bytes_of(tiny_low_state());
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decode_hg_low_state({Bytes(bytes).first(size), Encoding::cdr}));
}

TEST(LowState, FourFeetAreRefusedWithAReason) {
  GoLowStateMessage m;
  m.imu_state.imu.accelerometer = {0, 0, 9.75F};
  const auto bytes = write_message(m, Encoding::cdr);
  const auto sample = decode_go_low_state({bytes, Encoding::cdr});
  ASSERT_TRUE(sample) << sample.reason();
  EXPECT_EQ(sample->imu.accel.z(), 9.75);
  EXPECT_THAT(sample->joints.reason(), HasSubstr("its legs are not read"));
}

TEST(ImuState, OfTheTorsoIsAnImu) {
  HgImuMessage m;
  m.imu.gyroscope = {1, 2, 3};
  const auto bytes = write_message(m, Encoding::cdr);
  const auto decoded = decode_measurement(Sensor::imu, "unitree_hg/IMUState", {bytes, Encoding::cdr}, {});
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_EQ(std::get<ImuSample>(decoded->measurement).gyro, Eigen::Vector3d(1, 2, 3));
}

}  // namespace unitree_test
}  // namespace kilvo::lab
