// The definition of any message, as a recording carries it, read: what is needed to turn a message of one encoding into the other.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/messages/decoded.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// A field of a type; what it is of is either a number of a fixed size, or one of the kinds below.
struct SchemaField {
  enum class Kind : std::uint8_t { number, text, time, header, type };
  enum class Array : std::uint8_t { none, fixed, dynamic };

  std::string name;
  std::string type_name;  // as in ROS 1 and ROS 2 alike: float64, string, time, duration, geometry_msgs/Point
  Kind kind = Kind::number;
  Array array = Array::none;
  std::size_t bytes = 0;   // of a number
  std::size_t length = 0;  // of a fixed array
  std::size_t type = 0;    // index in MessageSchema::types
};

struct SchemaType {
  std::string name;  // "geometry_msgs/Point"
  std::vector<SchemaField> fields;
  std::vector<std::string> constants;  // "uint8 INT8=1"
};

class MessageSchema {
 public:
  /// `text`: in the way of ROS 1 and of ROS 2 (`ros1msg`, `ros2msg`): the type's own definition, then, behind lines of `=`, "MSG: NAME" and
  /// the definition of each type within. The error names the line that is not understood.
  static Decoded<MessageSchema> parse(std::string_view type, std::string_view text);

  const std::vector<SchemaType>& types() const { return types_; }  // the first is the message's own

  /// The same definition as ROS 1 or ROS 2 writes it.
  std::string text(Encoding encoding) const;

  /// The sum by which ROS 1 knows the type: MD5 over its constants and fields, with the sum of each type within in place of its name.
  std::string md5() const { return md5_of(0); }

  /// The same message in the other encoding.
  Decoded<std::vector<std::uint8_t>> convert(const WireMessage& from, Encoding to) const;

 private:
  std::optional<std::string> resolve();
  std::string md5_of(std::size_t type) const;

  std::vector<SchemaType> types_;
};

/// The definition of a type that KILVO reads or writes, as ROS 1 has it; empty for any other.
std::string_view known_definition(std::string_view type);

}  // namespace kilvo::lab
