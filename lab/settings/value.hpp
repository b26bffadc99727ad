// One value: from a YAML node, and back to text.
#pragma once

#include <stdexcept>
#include <yaml-cpp/yaml.h>

#include "lab/settings/setting_list.hpp"

namespace kilvo::lab {

/// A value that is not what its setting needs. `line` counts from 1.
struct BadValue : std::runtime_error {
  BadValue(const YAML::Node& node, const std::string& why) : std::runtime_error(why), line(node.Mark().line + 1) {}
  int line;
};

/// Stores the node's value in `to`. Throws BadValue when it is of another type, not finite, or not a rotation.
void read_value(const YAML::Node& node, const SettingValue& to);

/// "a number", "true or false", ... for error messages and documents.
std::string type_text(const SettingValue& value);

}  // namespace kilvo::lab
