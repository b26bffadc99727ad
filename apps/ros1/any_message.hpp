// A message of any type as it is on the wire: KILVO's own decoders and encoders read and write it.
#pragma once

#include <cstdint>
#include <cstring>
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <vector>

namespace kilvo::ros1 {

struct AnyMessage {
  std::vector<std::uint8_t> bytes;
};

/// Of all that ROS asks of a type: any. (Out of line: g++ 12 takes the inlined copy of so short a text for one that overlaps itself.)
struct AnyText {
  static const char* value();
  static const char* value(const AnyMessage&) { return value(); }
};

}  // namespace kilvo::ros1

// clang-format off
namespace ros::message_traits {
template <> struct IsMessage<kilvo::ros1::AnyMessage> : TrueType {};
template <> struct MD5Sum<kilvo::ros1::AnyMessage> : kilvo::ros1::AnyText {};
template <> struct DataType<kilvo::ros1::AnyMessage> : kilvo::ros1::AnyText {};
template <> struct Definition<kilvo::ros1::AnyMessage> : kilvo::ros1::AnyText {};
}  // namespace ros::message_traits
// clang-format on

namespace ros::serialization {

template <>
struct Serializer<kilvo::ros1::AnyMessage> {
  template <class Stream>
  static void read(Stream& stream, kilvo::ros1::AnyMessage& message) {
    message.bytes.assign(stream.getData(), stream.getData() + stream.getLength());
  }
  template <class Stream>
  static void write(Stream& stream, const kilvo::ros1::AnyMessage& message) {
    const auto size = static_cast<std::uint32_t>(message.bytes.size());
    std::uint8_t* to = stream.advance(size);
    if (size > 0) std::memcpy(to, message.bytes.data(), size);
  }
  static std::uint32_t serializedLength(const kilvo::ros1::AnyMessage& message) { return static_cast<std::uint32_t>(message.bytes.size()); }
};

}  // namespace ros::serialization
