// From a message of any type that KILVO reads, in either encoding, to measurements.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "lab/messages/point_cloud2.hpp"

namespace kilvo::lab {

/// The message types that a sensor may come as, the usual one first. Types have their plain_type_name().
const std::vector<std::string_view>& accepted_types(Sensor sensor);

bool is_type_of(Sensor sensor, std::string_view type);

/// Every sensor that a message of this type is one of: a LowState is of the IMU and of the legs.
std::vector<Sensor> sensors_of_type(std::string_view type);

struct DecodedMeasurement {
  Measurement measurement;                   // time 0 where the message has no stamp; of joints in a LowState: its tick
  std::size_t absurd_times = 0;              // LiDAR: points dropped because of their time
  std::optional<Eigen::Vector3d> gyro = {};  // rad/s, of joints in a LowState: of the pelvis, in its axes
  std::optional<std::uint32_t> tick = {};    // ms, wraps around: what a LowState has in place of a stamp
};

/// What a message says of one sensor; `point_time` matters for LiDAR types only, `with_colours` for images, `known`, the
/// names that messages before had, for joints. The error says why there is nothing.
Decoded<DecodedMeasurement> decode_measurement(Sensor sensor, std::string_view type, const WireMessage& message,
                                               const PointTimeFormat& point_time, bool with_colours = true, const JointNames& known = {});

/// For all LiDAR message types.
Decoded<CloudTimes> observe_cloud(std::string_view type, const WireMessage& message);
Decoded<PointTimeFormat> detect_point_time_of(std::string_view type, const std::vector<CloudTimes>& clouds, Duration nominal_period);

}  // namespace kilvo::lab
