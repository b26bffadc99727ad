// The time of ROS 1, as recordings have it too.
#pragma once

#include "kilvo/sensors/time.hpp"
#include "lab/messages/bytes.hpp"

namespace kilvo::lab {

/// uint32 seconds, uint32 nanoseconds. Always fits int64 nanoseconds.
inline Time read_ros_time(ByteReader& reader) {
  const std::int64_t seconds = reader.read<std::uint32_t>();
  const std::int64_t nanoseconds = reader.read<std::uint32_t>();
  return time_from_ns(seconds * 1'000'000'000 + nanoseconds);
}

}  // namespace kilvo::lab
