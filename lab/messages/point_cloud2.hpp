// sensor_msgs/PointCloud2 -> LidarScan: any field layout, padding, byte order and point-time convention.
#pragma once

#include "kilvo/sensors/measurement.hpp"
#include "lab/messages/decoded.hpp"
#include "lab/messages/encoding.hpp"
#include "lab/messages/point_time.hpp"

namespace kilvo::lab {

struct DecodedScan {
  LidarScan scan;
  std::size_t absurd_times = 0;  // points dropped because their time is not finite or too far from the stamp
};

/// More points than this in one message are refused: the largest LiDARs give a quarter of a million.
inline constexpr std::size_t most_points_in_a_cloud = 2'000'000;

/// Points in the order of the message; the scan's time is the header's stamp. Non-finite coordinates are passed on. Coordinates x y z
/// may be any number type; intensity (or reflectivity) is 0 when absent. The field of `format` must be there unless its reference is none.
Decoded<DecodedScan> decode_point_cloud2(const WireMessage& message, const PointTimeFormat& format);

/// What detect_point_time() needs from one message.
Decoded<CloudTimes> observe_point_cloud2(const WireMessage& message);

}  // namespace kilvo::lab
