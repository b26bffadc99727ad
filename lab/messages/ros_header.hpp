// std_msgs/Header, which begins nearly every message.
#pragma once

#include <string_view>

#include "kilvo/sensors/time.hpp"
#include "lab/messages/bytes.hpp"

namespace kilvo::lab {

struct RosHeader {
  Time stamp{};
  std::string_view frame_id;  // into the message's bytes
};

/// A ROS 1 time: uint32 seconds, uint32 nanoseconds. Always fits int64 nanoseconds.
inline Time read_ros_time(ByteReader& reader) {
  const std::int64_t seconds = reader.read<std::uint32_t>();
  const std::int64_t nanoseconds = reader.read<std::uint32_t>();
  return time_from_ns(seconds * 1'000'000'000 + nanoseconds);
}

inline RosHeader read_ros_header(ByteReader& reader) {
  reader.skip(4);  // seq
  RosHeader header;
  header.stamp = read_ros_time(reader);
  header.frame_id = reader.string();
  return header;
}

}  // namespace kilvo::lab
