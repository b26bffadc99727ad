// The list of all settings, made from the fields() of the structs they live in: reading, `--set`, `kilvo config show` and
// docs/parameters.md are loops over it.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "lab/settings/settings.hpp"

namespace kilvo::lab {

/// Where a setting's value is stored.
using SettingValue = std::variant<double*, int*, bool*, std::string*, std::vector<double>*, std::vector<std::string>*, Eigen::Vector3d*,
                                  SO3*, std::array<Foot, 2>*, std::map<std::string, JointReading>*>;

struct Setting {
  std::string key;           // "lidar.voxel_size"
  SettingValue value;        // in the Settings that the list was made of
  std::string_view unit;     // "-" when it has none
  std::string_view meaning;  // one sentence
  bool has_default = true;   // false: differs from robot to robot, so nothing is assumed
  bool advanced = true;      // rarely needed: for who knows the method
  std::string_view name() const { return std::string_view(key).substr(key.rfind('.') + 1); }
};

/// All settings, section by section; `settings` must outlive the list.
std::vector<Setting> list_settings(Settings& settings);

/// Which numbers make sense.
struct Range {
  double low, high;
  bool without_low = false;  // low itself does not make sense

  bool contains(double x) const { return x <= high && (without_low ? x > low : x >= low); }
  /// "above 0, at most 100".
  std::string text() const;
};

/// The range of a setting that is a number. A test asks that every number has one.
std::optional<Range> range_of(std::string_view key);

/// The texts that a setting may be, none when any text will do.
const std::vector<std::string>& choices_of(std::string_view key);

/// The present value as YAML that is JSON as well: 0.25, true, "text", [1, 2].
std::string value_text(const SettingValue& value);

}  // namespace kilvo::lab
