// The two ways in which the fields of one message type are laid out as bytes.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

#include "lab/messages/bytes.hpp"

namespace kilvo::lab {

enum class Encoding : std::uint8_t {
  ros1,   // ROS 1: packed, little-endian; arrays and strings behind a uint32 length
  cdr,    // ROS 2 and DDS: XCDR version 1, little-endian, behind an encapsulation header of 4 bytes; numbers aligned to their size
  other,  // nothing that KILVO reads
};

inline constexpr std::size_t encapsulation_bytes = 4;  // of CDR
inline constexpr std::size_t most_padding = 7;         // writers of CDR that align the end of a message do so to 4 or 8 bytes

inline const char* name_of(Encoding encoding) {
  constexpr const char* names[] = {"ros1", "cdr", "other"};
  return names[static_cast<int>(encoding)];
}

/// The bytes of one message, and how they are to be read.
struct WireMessage {
  Bytes bytes;
  Encoding encoding = Encoding::ros1;

  template <std::convertible_to<Bytes> B>
  WireMessage(const B& from, Encoding how = Encoding::ros1) : bytes(from), encoding(how) {}  // NOLINT(google-explicit-constructor)
};

/// One name for a type whatever calls it: "sensor_msgs/Imu" for itself, for "sensor_msgs/msg/Imu" (ROS 2) and for
/// "sensor_msgs::msg::dds_::Imu_" (DDS). Any other text comes back as it is.
std::string plain_type_name(std::string_view name);

/// "sensor_msgs/msg/Imu" for "sensor_msgs/Imu".
std::string ros2_type_name(std::string_view plain);

}  // namespace kilvo::lab
