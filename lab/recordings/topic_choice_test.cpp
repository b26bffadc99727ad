#include "lab/recordings/topic_choice.hpp"

#include <gtest/gtest.h>

#include "lab/messages/input_error.hpp"

namespace kilvo::lab {
namespace topic_choice_test {

using Connections = std::map<std::uint32_t, Channel>;

Connections g1_topics() {
  return {{0, {0, "/livox/imu", "sensor_msgs/Imu", ""}},
          {1, {1, "/livox/lidar", "sensor_msgs/PointCloud2", ""}},
          {2, {2, "/camera/color/image_raw/compressed", "sensor_msgs/CompressedImage", ""}},
          {3, {3, "/camera/color/camera_info", "sensor_msgs/CameraInfo", ""}},
          {4, {4, "/livox/inu", "std_msgs/String", ""}}};
}

std::string error_of(const Connections& connections, Sensor sensor, const std::string& pattern) {
  try {
    choose_topic(connections, sensor, pattern);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ChooseTopic, TakesTheTopicByName) {
  const auto chosen = choose_topic(g1_topics(), Sensor::imu, "/livox/imu");
  EXPECT_EQ(chosen.topic, "/livox/imu");
  EXPECT_EQ(chosen.type, "sensor_msgs/Imu");
  EXPECT_EQ(choose_topic(g1_topics(), Sensor::imu, "livox/imu").topic, "/livox/imu") << "the leading slash does not matter";
}

TEST(ChooseTopic, ACameraTopicMeansItsCompressedImagesToo) {
  auto topics = g1_topics();
  EXPECT_EQ(choose_topic(topics, Sensor::camera, "/camera/color/image_raw").topic, "/camera/color/image_raw/compressed");
  topics[9] = {9, "/camera/color/image_raw", "sensor_msgs/Image", ""};
  EXPECT_EQ(choose_topic(topics, Sensor::camera, "/camera/color/image_raw").topic, "/camera/color/image_raw")
      << "raw images need no decoding";
  EXPECT_EQ(choose_topic(topics, Sensor::camera, "/camera/color/image_raw/compressed").topic, "/camera/color/image_raw/compressed");
}

TEST(ChooseTopic, OnlyCamerasHaveCompressedTopics) {
  EXPECT_FALSE(topic_matches(Sensor::lidar, "/livox/lidar", "/livox/lidar/compressed"));
}

TEST(ChooseTopic, AMissingTopicNamesTheNearestOfTheRightType) {
  // /livox/inu is spelled nearer, but is no IMU.
  EXPECT_EQ(error_of(g1_topics(), Sensor::imu, "/livox/inus"),
            "no topic /livox/inus for the sensor imu; the nearest is /livox/imu (sensor_msgs/Imu)");
}

TEST(ChooseTopic, WhenNoTopicIsOfTheRightTypeItSaysSo) {
  EXPECT_EQ(error_of(g1_topics(), Sensor::legs, "/joint_states"),
            "no topic /joint_states for the sensor legs; the nearest is /livox/imu (sensor_msgs/Imu), but none is of type "
            "sensor_msgs/JointState or unitree_hg/LowState or unitree_go/LowState");
  EXPECT_EQ(error_of({}, Sensor::legs, "/joint_states"), "no topic /joint_states for the sensor legs: the recording has no topics");
}

TEST(ChooseTopic, ATopicOfAWrongTypeIsRefusedWithTheTypesAccepted) {
  EXPECT_EQ(error_of(g1_topics(), Sensor::camera, "/camera/color/camera_info"),
            "topic /camera/color/camera_info is of type sensor_msgs/CameraInfo, but the sensor camera needs sensor_msgs/Image or "
            "sensor_msgs/CompressedImage");
}

TEST(EditDistance, CountsChanges) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("imu", ""), 3U);
  EXPECT_EQ(edit_distance("", "imu"), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("/livox/imu", "/livox/imu"), 0U);
}

}  // namespace topic_choice_test
}  // namespace kilvo::lab
