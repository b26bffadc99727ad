#include "lab/messages/message_decoder.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "lab/messages/compressed_image.hpp"
#include "lab/messages/inertial_and_joints.hpp"
#include "lab/messages/livox.hpp"
#include "lab/messages/raw_image.hpp"
#include "lab/messages/unitree.hpp"

namespace kilvo::lab {
namespace {

constexpr std::string_view cloud_type = "sensor_msgs/PointCloud2";
constexpr std::string_view hg_low_state = "unitree_hg/LowState", hg_imu_state = "unitree_hg/IMUState";
constexpr std::string_view go_low_state = "unitree_go/LowState";

template <class T>
Decoded<DecodedMeasurement> plain(Decoded<T> decoded) {
  if (!decoded) return DecodeError{decoded.reason()};
  return DecodedMeasurement{*std::move(decoded), 0};
}

Decoded<DecodedMeasurement> timed(Decoded<DecodedScan> decoded) {
  if (!decoded) return DecodeError{decoded.reason()};
  return DecodedMeasurement{std::move(decoded->scan), decoded->absurd_times};
}

Decoded<DecodedMeasurement> part(Sensor sensor, Decoded<UnitreeSample> decoded) {
  if (!decoded) return DecodeError{decoded.reason()};
  auto measurement = sensor == Sensor::imu ? plain<ImuSample>(decoded->imu) : plain(std::move(decoded->joints));
  if (!measurement) return measurement;
  measurement->tick = decoded->tick;
  if (sensor == Sensor::legs) measurement->gyro = decoded->imu.gyro;
  return measurement;
}

}  // namespace

const std::vector<std::string_view>& accepted_types(Sensor sensor) {
  static const std::array<std::vector<std::string_view>, sensor_count> types{{
      {"sensor_msgs/Imu", hg_low_state, hg_imu_state, go_low_state},
      {"sensor_msgs/JointState", hg_low_state, go_low_state},
      {cloud_type, "livox_ros_driver/CustomMsg", "livox_ros_driver2/CustomMsg"},
      {"sensor_msgs/Image", "sensor_msgs/CompressedImage"},
  }};
  return types[static_cast<std::size_t>(sensor)];
}

bool is_type_of(Sensor sensor, std::string_view type) { return std::ranges::count(accepted_types(sensor), type) != 0; }

std::vector<Sensor> sensors_of_type(std::string_view type) {
  std::vector<Sensor> sensors;
  std::ranges::copy_if(all_sensors, std::back_inserter(sensors), [type](Sensor s) { return is_type_of(s, type); });
  return sensors;
}

Decoded<DecodedMeasurement> decode_measurement(Sensor sensor, std::string_view type, const WireMessage& message,
                                               const PointTimeFormat& point_time, bool with_colours, const JointNames& known) {
  if (!is_type_of(sensor, type)) return DecodeError{std::string(type) + " is not read for the sensor " + name_of(sensor)};
  if (type == hg_low_state) return part(sensor, decode_hg_low_state(message));
  if (type == go_low_state) return part(sensor, decode_go_low_state(message));
  switch (sensor) {
    case Sensor::imu:
      return plain(type == hg_imu_state ? decode_hg_imu_state(message) : decode_imu(message));
    case Sensor::legs:
      return plain(decode_joint_state(message, known));
    case Sensor::lidar:
      return timed(type == cloud_type ? decode_point_cloud2(message, point_time) : decode_livox(message, point_time));
    case Sensor::camera:
      break;
  }
  auto image = type == "sensor_msgs/Image" ? decode_image(message) : decode_compressed_image(message, with_colours);
  if (image) image->colours = with_colours;
  return plain(std::move(image));
}

Decoded<CloudTimes> observe_cloud(std::string_view type, const WireMessage& message) {
  return type == cloud_type ? observe_point_cloud2(message) : observe_livox(message);
}

Decoded<PointTimeFormat> detect_point_time_of(std::string_view type, const std::vector<CloudTimes>& clouds, Duration nominal_period) {
  return type == cloud_type ? detect_point_time(clouds, nominal_period) : detect_livox_point_time(clouds);
}

}  // namespace kilvo::lab
