#include "lab/recordings/description.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/messages/input_error.hpp"
#include "lab/messages/tiny_cloud.hpp"
#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace description_test {

const MessageType odometry{"nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7", ""};

const TopicDescription& topic_of(const RecordingDescription& description, const std::string& name) {
  const auto it = std::ranges::find(description.topics, name, &TopicDescription::topic);
  if (it == description.topics.end()) throw std::runtime_error("no topic " + name);
  return *it;
}

TEST(DescribeRecording, ListsTopicsWithRatesAndUses) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  RecordingOptions options;
  options[Sensor::imu].topic = "/imu";
  options[Sensor::camera].topic = "/nothing/like/it";
  const auto description = describe_recording(folder / "walk.bag", options);
  EXPECT_EQ(description.file, (folder / "walk.bag").string());
  EXPECT_EQ(description.bytes, std::filesystem::file_size(folder / "walk.bag"));
  EXPECT_EQ(description.storage.compression, "none");
  EXPECT_EQ(description.messages, tiny_walk().size());
  EXPECT_TRUE(description.damages.empty());
  ASSERT_EQ(description.topics.size(), 4U);

  const auto& imu = topic_of(description, "/imu");
  EXPECT_EQ(imu.type, "sensor_msgs/Imu");
  EXPECT_EQ(imu.count, 50U);
  EXPECT_NEAR(imu.rate, 100, 1e-9);
  EXPECT_NEAR(imu.largest_gap, 0.01, 1e-12);
  EXPECT_EQ(imu.fits, std::vector{Sensor::imu});
  EXPECT_EQ(imu.used_for, std::vector{Sensor::imu});
  EXPECT_EQ(imu.detail, "first acceleration 9.81, so in m/s^2");

  const auto& lidar = topic_of(description, "/points");
  EXPECT_EQ(lidar.fits, std::vector{Sensor::lidar});
  EXPECT_TRUE(lidar.used_for.empty());
  EXPECT_EQ(lidar.detail, "point time timestamp (float64): nanoseconds, absolute");
  EXPECT_EQ(topic_of(description, "/joints").detail, "2 names: left_knee_joint right_knee_joint");
  EXPECT_EQ(topic_of(description, "/camera/image_raw").detail, "16x8 grey");
}

TEST(DescribeRecording, TopicsThatCannotBeUsedAreNoError) {
  const TemporaryFolder folder;
  {
    Rosbag1Writer writer(folder / "odd.bag");
    const auto clouds = writer.add_connection("/points", written_type(Sensor::lidar));
    const auto odom = writer.add_connection("/odom", odometry);
    const auto feet = writer.add_connection("/feet", written_type(Sensor::legs));
    writer.add_connection("/silent", written_type(Sensor::imu));
    writer.write(clouds, tiny_begin, TinyCloud::line(150).bytes());
    writer.write(odom, tiny_begin, std::vector<std::uint8_t>(3));
    writer.write(feet, tiny_begin, encode(JointSample{tiny_begin, {}, {1, 2, 3, 4, 5, 6}, {}, {}}, ""));
    writer.close();
  }
  const auto description = describe_recording(folder / "odd.bag");
  EXPECT_THAT(topic_of(description, "/points").detail, ::testing::HasSubstr("the clouds have no point times (fields: x y z intensity)"));
  EXPECT_TRUE(topic_of(description, "/odom").fits.empty());
  EXPECT_EQ(topic_of(description, "/odom").count, 1U);
  EXPECT_EQ(topic_of(description, "/feet").detail, "6 positions without names: the two-feet message");
  EXPECT_EQ(topic_of(description, "/silent").count, 0U);
}

TEST(DescribeRecording, ACutRecordingIsDescribedAsFarAsItGoes) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  const auto content = file_content(folder / "walk.bag");
  set_file_content(folder / "cut.bag", Bytes(content).first(content.size() / 2));
  const auto description = describe_recording(folder / "cut.bag");
  EXPECT_EQ(description.damages.size(), 1U);
  const auto& imu = topic_of(description, "/imu");
  EXPECT_GT(imu.count, 10U);
  EXPECT_LT(imu.count, 40U);
  EXPECT_NEAR(imu.rate, 100, 1e-9);
}

}  // namespace description_test
}  // namespace kilvo::lab
