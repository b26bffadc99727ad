#include "lab/messages/encode.hpp"

#include <gtest/gtest.h>

#include "lab/messages/message_decoder.hpp"

namespace kilvo::lab {
namespace encode_test {

const PointTimeFormat absolute_ns{"timestamp", "float64", TimeUnit::nanoseconds, TimeReference::absolute, true};

TEST(Encode, EveryMeasurementComesBackFromTheTypeItIsWrittenAs) {
  const Time t = time_from_ns(1'700'000'000'000'000'000);
  const std::vector<Measurement> measurements{ImuSample{t, {1, 2, 3}, {4, 5, 6}}, JointSample{t, {"knee"}, {0.5}, {}, {}},
                                              LidarScan{t, {{1, 2, 3, 4, 512}}}, CameraImage{t, {2, 1, 1, {7, 8}}}};
  for (const auto& measurement : measurements) {
    const Sensor sensor = sensor_of(measurement);
    const auto& type = written_type(sensor);
    EXPECT_TRUE(is_type_of(sensor, type.name));
    const auto decoded = decode_measurement(sensor, type.name, encode(measurement, "frame"), absolute_ns);
    ASSERT_TRUE(decoded) << decoded.reason();
    EXPECT_EQ(sensor_of(decoded->measurement), sensor);
    EXPECT_EQ(encode(decoded->measurement, "frame"), encode(measurement, "frame"));
  }
}

TEST(DecodeMeasurement, RefusesATypeItDoesNotKnow) {
  const auto decoded = decode_measurement(Sensor::imu, "nav_msgs/Odometry", Bytes{}, {});
  EXPECT_EQ(decoded.reason(), "nav_msgs/Odometry is not read for the sensor imu");
}

TEST(AcceptedTypes, BothLivoxDriversAreLidars) {
  EXPECT_EQ(sensors_of_type("livox_ros_driver/CustomMsg"), std::vector{Sensor::lidar});
  EXPECT_EQ(sensors_of_type("livox_ros_driver2/CustomMsg"), std::vector{Sensor::lidar});
  EXPECT_EQ(sensors_of_type("sensor_msgs/CompressedImage"), std::vector{Sensor::camera});
  EXPECT_EQ(sensors_of_type("unitree_hg/LowState"), (std::vector{Sensor::imu, Sensor::legs}));
  EXPECT_TRUE(sensors_of_type("sensor_msgs/CameraInfo").empty());
}

}  // namespace encode_test
}  // namespace kilvo::lab
