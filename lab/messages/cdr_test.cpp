// The same messages in CDR, as ROS 2 and DDS have them. The bytes written out here follow the OMG's rules by hand, not our writer.
#include <gtest/gtest.h>

#include "lab/messages/compressed_image.hpp"
#include "lab/messages/encode.hpp"
#include "lab/messages/inertial_and_joints.hpp"
#include "lab/messages/livox.hpp"
#include "lab/messages/message_decoder.hpp"
#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_reader.hpp"
#include "lab/messages/wire_writer.hpp"

namespace kilvo::lab {
namespace cdr_test {

using Content = std::vector<std::uint8_t>;
const Time stamp = time_from_ns(1'700'000'000'000'000'001);
const PointTimeFormat absolute_ns{"timestamp", "float64", TimeUnit::nanoseconds, TimeReference::absolute, true};

WireMessage cdr(const Content& bytes) { return {bytes, Encoding::cdr}; }

/// Stamp 1 s and 2 ns, frame "ab": the text ends with a zero, and what follows is aligned to four from behind the first four bytes.
Content header() { return {0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 'a', 'b', 0}; }

Content operator+(Content a, const Content& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(Cdr, AlignsNumbersAndEndsTextWithZero) {
  // One name "knees"; one position 1.5; no velocity, one effort 2: a double begins at a multiple of eight.
  const Content joints = header() + Content{0, 1, 0, 0, 0, 6, 0, 0, 0, 'k', 'n', 'e', 'e', 's', 0, 0, 0} + Content{1, 0, 0, 0} +
                         Content(4, 0) + Content{0, 0, 0, 0, 0, 0, 0xF8, 0x3F} + Content{0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x40};
  const auto decoded = decode_joint_state(cdr(joints));
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_EQ(decoded->t, time_from_ns(1'000'000'002));
  EXPECT_EQ(decoded->names, std::vector<std::string>{"knees"});
  EXPECT_EQ(decoded->position, std::vector{1.5});
  EXPECT_TRUE(decoded->velocity.empty());
  EXPECT_EQ(decoded->effort, std::vector{2.0});
  const JointSample same{time_from_ns(1'000'000'002), {"knees"}, {1.5}, {}, {2}};
  EXPECT_EQ(encode(same, "ab", Encoding::cdr), joints);
}

TEST(Cdr, PointsOfALivoxCloudBeginAtMultiplesOfFour) {
  const Content point{5, 0, 0, 0, 0, 0, 0x80, 0x3F, 0, 0, 0, 0x40, 0, 0, 0x40, 0x40, 42, 0x10, 1};  // 5 ns, (1, 2, 3), 42
  Content bytes = header() + Content(1, 0) + Content(8, 0) + Content{2, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0};
  bytes = bytes + point + Content{0} + point;
  const PointTimeFormat timed{"offset_time", "uint32", TimeUnit::nanoseconds, TimeReference::scan_start, true};
  const auto decoded = decode_livox(cdr(bytes), timed);
  ASSERT_TRUE(decoded) << decoded.reason();
  ASSERT_EQ(decoded->scan.points.size(), 2U);
  for (const LidarPoint& p : decoded->scan.points) {
    EXPECT_EQ(p.z, 3);
    EXPECT_EQ(p.intensity, 42);
    EXPECT_EQ(p.offset_ns, 5);
  }
  EXPECT_EQ(write_message(*read_message<LivoxMessage>(cdr(bytes)), Encoding::cdr), bytes);
  const Content ros1 = write_message(*read_message<LivoxMessage>(cdr(bytes)), Encoding::ros1);
  EXPECT_EQ(decode_livox(ros1, timed)->scan.points.size(), 2U);
  EXPECT_EQ(write_message(*read_message<LivoxMessage>(ros1), Encoding::cdr), bytes);
}

TEST(Cdr, EveryMeasurementComesBack) {
  const std::vector<Measurement> measurements{ImuSample{stamp, {1, 2, 3}, {4, 5, 6}}, JointSample{stamp, {"knee"}, {0.5}, {}, {}},
                                              LidarScan{stamp, {{1, 2, 3, 4, 511}, {5, 6, 7, 8, 0}}},
                                              CameraImage{stamp, {2, 1, 1, {7, 8}}}};
  for (const auto& measurement : measurements) {
    const Sensor sensor = sensor_of(measurement);
    for (const std::string frame : {"", "a", "abc", "imu_link"}) {
      const Content bytes = encode(measurement, frame, Encoding::cdr);
      const auto decoded = decode_measurement(sensor, written_type(sensor).name, cdr(bytes), absolute_ns);
      ASSERT_TRUE(decoded) << decoded.reason();
      EXPECT_EQ(encode(decoded->measurement, frame), encode(measurement, frame));
      for (std::size_t size = 0; size < bytes.size(); ++size) {
        const auto cut = decode_measurement(sensor, written_type(sensor).name, {Bytes(bytes).first(size), Encoding::cdr}, absolute_ns);
        EXPECT_FALSE(cut) << size;
      }
    }
  }
}

TEST(Cdr, ACompressedImageIsThatOfRos1) {
  CompressedImageMessage m;
  m.header.stamp = stamp;
  m.format = "x";
  const Content file{1, 2, 3};
  m.data = Numbers<std::uint8_t>::of(file);
  EXPECT_EQ(decode_compressed_image(cdr(write_message(m, Encoding::cdr))).reason(),
            decode_compressed_image(write_message(m, Encoding::ros1)).reason());
}

TEST(Cdr, OnlyPlainLittleEndianIsRead) {
  Content bytes = encode(ImuSample{stamp, {1, 2, 3}, {4, 5, 6}}, "imu", Encoding::cdr);
  bytes[1] = 0;
  EXPECT_EQ(decode_imu(cdr(bytes)).reason(), "sensor_msgs/Imu: big-endian CDR is not read");
  bytes[1] = 3;
  EXPECT_EQ(decode_imu(cdr(bytes)).reason(), "sensor_msgs/Imu: CDR representation 3 is not read (1 is: plain CDR, little-endian)");
  EXPECT_EQ(decode_imu(cdr({0, 1})).reason(), "sensor_msgs/Imu: shorter than the encapsulation header of CDR");
  EXPECT_EQ(decode_imu(WireMessage(bytes, Encoding::other)).reason(), "sensor_msgs/Imu: its encoding is neither ros1 nor cdr");
}

TEST(Cdr, MayBePaddedAtItsEndButNotMore) {
  Content bytes = encode(ImuSample{stamp, {1, 2, 3}, {4, 5, 6}}, "imu", Encoding::cdr);
  bytes.resize(bytes.size() + 7);
  EXPECT_TRUE(decode_imu(cdr(bytes)));
  bytes.push_back(0);
  EXPECT_FALSE(decode_imu(cdr(bytes)));
}

TEST(Cdr, CountsThatTheBytesCannotHoldAreRefused) {
  for (const std::uint8_t top : Content{0x00, 0x1F, 0x20, 0x7F, 0xFF}) {
    EXPECT_FALSE(decode_joint_state(cdr(header() + Content{0, 0xFF, 0xFF, 0xFF, top} + Content(16, 0)))) << int{top};
    EXPECT_FALSE(decode_joint_state(cdr(header() + Content{0, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, top} + Content(16, 0)))) << int{top};
  }
}

TEST(Cdr, TimesBefore1970AreNegative) {
  const Time early = time_from_ns(-1'500'000'000);
  EXPECT_EQ(decode_imu(cdr(encode(ImuSample{early, {}, {}}, "", Encoding::cdr)))->t, early);
}

TEST(TypeNames, AreTheSameWhoeverWritesThem) {
  for (const char* name : {"sensor_msgs/Imu", "sensor_msgs/msg/Imu", "sensor_msgs::msg::dds_::Imu_", "sensor_msgs::msg::Imu"})
    EXPECT_EQ(plain_type_name(name), "sensor_msgs/Imu");
  EXPECT_EQ(plain_type_name("foxglove.PointCloud"), "foxglove.PointCloud");
  EXPECT_EQ(ros2_type_name("sensor_msgs/Imu"), "sensor_msgs/msg/Imu");
  EXPECT_EQ(ros2_type_name("sensor_msgs/msg/Imu"), "sensor_msgs/msg/Imu");
}

}  // namespace cdr_test
}  // namespace kilvo::lab
