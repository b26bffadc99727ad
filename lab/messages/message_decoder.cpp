#include "lab/messages/message_decoder.hpp"

#include <algorithm>
#include <array>

#include "lab/messages/compressed_image.hpp"
#include "lab/messages/inertial_and_joints.hpp"
#include "lab/messages/livox.hpp"
#include "lab/messages/raw_image.hpp"

namespace kilvo::lab {
namespace {

constexpr std::string_view point_cloud2 = "sensor_msgs/PointCloud2";

template <class T>
Decoded<DecodedMeasurement> plain(Decoded<T> decoded) {
  if (!decoded) return DecodeError{decoded.reason()};
  return DecodedMeasurement{*std::move(decoded), 0};
}

Decoded<DecodedMeasurement> timed(Decoded<DecodedScan> decoded) {
  if (!decoded) return DecodeError{decoded.reason()};
  return DecodedMeasurement{std::move(decoded->scan), decoded->absurd_times};
}

}  // namespace

const std::vector<std::string_view>& accepted_types(Sensor sensor) {
  static const std::array<std::vector<std::string_view>, sensor_count> types{{
      {"sensor_msgs/Imu"},
      {"sensor_msgs/JointState"},
      {point_cloud2, "livox_ros_driver/CustomMsg", "livox_ros_driver2/CustomMsg"},
      {"sensor_msgs/Image", "sensor_msgs/CompressedImage"},
  }};
  return types[static_cast<std::size_t>(sensor)];
}

std::optional<Sensor> sensor_of_type(std::string_view ros_type) {
  for (int i = 0; i < sensor_count; ++i) {
    const auto sensor = static_cast<Sensor>(i);
    if (std::ranges::count(accepted_types(sensor), ros_type) != 0) return sensor;
  }
  return std::nullopt;
}

Decoded<DecodedMeasurement> decode_measurement(std::string_view ros_type, Bytes message, const PointTimeFormat& point_time) {
  const auto sensor = sensor_of_type(ros_type);
  if (!sensor) return DecodeError{std::string(ros_type) + " is not read"};
  switch (*sensor) {
    case Sensor::imu:
      return plain(decode_imu(message));
    case Sensor::legs:
      return plain(decode_joint_state(message));
    case Sensor::lidar:
      return timed(ros_type == point_cloud2 ? decode_point_cloud2(message, point_time) : decode_livox(message, point_time));
    case Sensor::camera:
      break;
  }
  return plain(ros_type == "sensor_msgs/Image" ? decode_image(message) : decode_compressed_image(message));
}

Decoded<CloudTimes> observe_cloud(std::string_view ros_type, Bytes message) {
  return ros_type == point_cloud2 ? observe_point_cloud2(message) : observe_livox(message);
}

Decoded<PointTimeFormat> detect_point_time_of(std::string_view ros_type, const std::vector<CloudTimes>& clouds, Duration nominal_period) {
  return ros_type == point_cloud2 ? detect_point_time(clouds, nominal_period) : detect_livox_point_time(clouds);
}

}  // namespace kilvo::lab
