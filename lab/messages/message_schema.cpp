#include "lab/messages/message_schema.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <md5.h>

namespace kilvo::lab {
namespace {

using Kind = SchemaField::Kind;
using Array = SchemaField::Array;

constexpr std::size_t most_types = 200, most_fields = 2000, deepest = 20;

struct Number {
  std::string_view name;
  std::size_t bytes;
};
constexpr std::array<Number, 13> numbers{{{"bool", 1},
                                          {"byte", 1},
                                          {"char", 1},
                                          {"int8", 1},
                                          {"uint8", 1},
                                          {"int16", 2},
                                          {"uint16", 2},
                                          {"int32", 4},
                                          {"uint32", 4},
                                          {"int64", 8},
                                          {"uint64", 8},
                                          {"float32", 4},
                                          {"float64", 8}}};

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

std::string_view take_word(std::string_view& text) {
  text = trimmed(text);
  const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
  const std::string_view word = text.substr(0, end);
  text = trimmed(text.substr(end));
  return word;
}

bool set_kind(SchemaField& field) {
  const auto number = std::ranges::find(numbers, std::string_view(field.type_name), &Number::name);
  field.kind = Kind::type;
  if (number != numbers.end()) {
    field.kind = Kind::number;
    field.bytes = number->bytes;
  }
  if (field.type_name == "string") field.kind = Kind::text;
  if (field.type_name == "time" || field.type_name == "builtin_interfaces/Time") field.type_name = "time", field.kind = Kind::time;
  if (field.type_name == "duration" || field.type_name == "builtin_interfaces/Duration")
    field.type_name = "duration", field.kind = Kind::time;
  if (field.type_name == "Header" || field.type_name == "std_msgs/Header") field.type_name = "std_msgs/Header", field.kind = Kind::header;
  return field.type_name != "wstring";
}

/// "TYPE[N] NAME", with limits (string<=10, [<=3]) and a default behind the name, as ROS 2 has them.
bool parse_field(std::string_view line, const std::string& package, SchemaType& type) {
  std::string_view rest = line;
  std::string_view word = take_word(rest);
  const std::string_view name = take_word(rest);
  if (name.empty()) return false;
  SchemaField field;
  field.name = name;
  const std::size_t bracket = word.find('[');
  if (bracket != std::string_view::npos) {
    const std::size_t close = word.find(']', bracket);
    if (close == std::string_view::npos) return false;
    const std::string_view length = word.substr(bracket + 1, close - bracket - 1);
    field.array = length.empty() || length.starts_with("<=") ? Array::dynamic : Array::fixed;
    if (field.array == Array::fixed) {
      const auto [end, error] = std::from_chars(length.data(), length.data() + length.size(), field.length);
      if (error != std::errc() || end != length.data() + length.size() || field.length == 0 || field.length > 1'000'000) return false;
    }
    word = word.substr(0, bracket);
  }
  word = word.substr(0, word.find("<="));
  field.type_name = plain_type_name(word);
  if (!set_kind(field)) return false;
  if (field.kind == Kind::type && field.type_name.find('/') == std::string::npos) field.type_name = package + "/" + field.type_name;
  type.fields.push_back(std::move(field));
  return true;
}

/// Nothing for a line that has neither field nor constant.
bool parse_line(std::string_view line, const std::string& package, SchemaType& type) {
  const std::size_t equals = line.find('='), comment = line.find('#');
  const bool text_constant = trimmed(line).starts_with("string ") && equals < comment;  // in which # is part of the text
  if (!text_constant) line = line.substr(0, comment);
  line = trimmed(line);
  if (line.empty()) return true;
  // A limit has an = as well; a constant's stands behind its name.
  std::string_view rest = line;
  take_word(rest);
  const std::size_t assigned = rest.find('=');
  const bool is_default = trimmed(rest.substr(0, assigned)).find_first_of(" \t\"'[") != std::string_view::npos;
  if (assigned == std::string_view::npos || is_default) return parse_field(line, package, type);
  type.constants.emplace_back(line);
  return true;
}

/// ROS 2 allows small letters only; of the types of both, CameraInfo alone has others in ROS 1.
std::string field_name_in(Encoding encoding, std::string_view type, std::string name) {
  constexpr std::string_view matrices = "dkrp";
  if (encoding == Encoding::cdr) {
    for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  } else if (type == "sensor_msgs/CameraInfo" && name.size() == 1 && matrices.find(name) != std::string_view::npos) {
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
  }
  return name;
}

/// "[]", "[3]" or nothing.
std::string length_of(const SchemaField& field) {
  if (field.array == Array::none) return {};
  std::string text = "[";
  if (field.array == Array::fixed) text.append(std::to_string(field.length));
  return text.append("]");
}

std::string package_of(std::string_view type) { return std::string(type.substr(0, type.find('/'))); }

}  // namespace

Decoded<MessageSchema> MessageSchema::parse(std::string_view type, std::string_view text) {
  MessageSchema schema;
  schema.types_.push_back({std::string(type), {}, {}});
  while (!text.empty()) {
    const std::string_view line = trimmed(take_line(text));
    if (line.starts_with("=====")) {
      std::string_view name = trimmed(take_line(text));
      if (!name.starts_with("MSG:")) return DecodeError{"the definition of " + std::string(type) + " has a section without MSG:"};
      schema.types_.push_back({plain_type_name(trimmed(name.substr(4))), {}, {}});
    } else if (!parse_line(line, package_of(schema.types_.back().name), schema.types_.back())) {
      return DecodeError{"the definition of " + std::string(type) + ": not understood: " + std::string(line.substr(0, 80))};
    }
    if (schema.types_.size() > most_types || schema.types_.back().fields.size() > most_fields)
      return DecodeError{"the definition of " + std::string(type) + " is too long"};
  }
  if (auto fault = schema.resolve()) return DecodeError{"the definition of " + std::string(type) + ": " + *fault};
  return schema;
}

/// Finds the types within. A type that leads back to itself would never end.
std::optional<std::string> MessageSchema::resolve() {
  for (SchemaType& type : types_) {
    for (SchemaField& field : type.fields) {
      if (field.kind != Kind::type) continue;
      auto found = std::ranges::find(types_, field.type_name, &SchemaType::name);
      const std::string short_name = field.type_name.substr(field.type_name.find('/') + 1);
      // ROS 1 may leave the package out where it is the same.
      if (found == types_.end()) found = std::ranges::find(types_, short_name, &SchemaType::name);
      if (found == types_.end()) return field.type_name + " is missing";
      field.type = static_cast<std::size_t>(found - types_.begin());
    }
  }
  const std::function<bool(std::size_t, std::size_t)> ends = [&](std::size_t type, std::size_t depth) {
    return depth < deepest &&
           std::ranges::all_of(types_[type].fields, [&](const SchemaField& f) { return f.kind != Kind::type || ends(f.type, depth + 1); });
  };
  return ends(0, 0) ? std::nullopt : std::optional<std::string>("types within each other without end");
}

std::string MessageSchema::text(Encoding encoding) const {
  const bool ros2 = encoding == Encoding::cdr;
  const std::string line(80, '=');
  bool any_time = false, any_duration = false, any_header = false;
  const auto name_in = [&](const SchemaField& field) -> std::string {
    any_time |= field.type_name == "time";
    any_duration |= field.type_name == "duration";
    any_header |= field.kind == Kind::header;
    if (ros2 && field.kind == Kind::time) return field.type_name == "time" ? "builtin_interfaces/Time" : "builtin_interfaces/Duration";
    return field.type_name;
  };
  std::string out;
  for (const SchemaType& type : types_) {
    if (type.name == "std_msgs/Header" && &type != &types_.front()) continue;
    if (type.name.starts_with("builtin_interfaces/")) continue;
    if (&type != &types_.front()) out += line + "\nMSG: " + type.name + "\n";
    for (const std::string& constant : type.constants) out += constant + "\n";
    for (const SchemaField& field : type.fields) {
      out += name_in(field) + length_of(field) + " " + field_name_in(encoding, type.name, field.name) + "\n";
    }
  }
  if (any_header)
    out +=
        line + "\nMSG: std_msgs/Header\n" + (ros2 ? "builtin_interfaces/Time stamp\n" : "uint32 seq\ntime stamp\n") + "string frame_id\n";
  if (ros2 && (any_time || any_header)) out += line + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
  if (ros2 && any_duration) out += line + "\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n";
  return out;
}

std::string MessageSchema::md5_of(std::size_t index) const {
  constexpr const char* header = "2176decaecbce78abc3b96ef049fabed";  // of std_msgs/Header
  std::string text;
  for (const std::string& constant : types_[index].constants) {
    // "TYPE NAME=VALUE", however it was spaced.
    std::string_view rest = constant;
    const std::string_view type = take_word(rest);
    const std::size_t equals = rest.find('=');
    text.append(type).append(" ").append(trimmed(rest.substr(0, equals))).append("=").append(trimmed(rest.substr(equals + 1))).append("\n");
  }
  for (const SchemaField& field : types_[index].fields) {
    if (field.kind == Kind::header || field.kind == Kind::type) {
      text += (field.kind == Kind::header ? std::string(header) : md5_of(field.type)) + " " + field.name + "\n";
      continue;
    }
    text += field.type_name + length_of(field) + " " + field_name_in(Encoding::ros1, types_[index].name, field.name) + "\n";
  }
  if (!text.empty()) text.pop_back();
  std::array<char, MD5_DIGEST_STRING_LENGTH> sum{};
  MD5Data(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), sum.data());
  return sum.data();
}

}  // namespace kilvo::lab
