// The one door from a message of any type that KILVO reads to a Measurement.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "lab/messages/point_cloud2.hpp"

namespace kilvo::lab {

/// The ROS message types that a sensor may come as; the usual one first.
const std::vector<std::string_view>& accepted_types(Sensor sensor);

/// The sensor that a message type would be used for, if any.
std::optional<Sensor> sensor_of_type(std::string_view ros_type);

struct DecodedMeasurement {
  Measurement measurement;
  std::size_t absurd_times = 0;  // LiDAR: points dropped because of their time
};

/// `ros_type` is one of accepted_types(); `point_time` matters for LiDAR types only.
Decoded<DecodedMeasurement> decode_measurement(std::string_view ros_type, Bytes message, const PointTimeFormat& point_time);

/// For both LiDAR message types.
Decoded<CloudTimes> observe_cloud(std::string_view ros_type, Bytes message);
Decoded<PointTimeFormat> detect_point_time_of(std::string_view ros_type, const std::vector<CloudTimes>& clouds, Duration nominal_period);

}  // namespace kilvo::lab
