#include "lab/settings/show_settings.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <limits>

#include "lab/settings/setting_list.hpp"
#include "lab/settings/value.hpp"

namespace kilvo::lab {
namespace {

std::vector<std::string> parts_of(const std::string& key) {
  std::vector<std::string> out;
  std::size_t begin = 0;
  for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', begin)) {
    out.push_back(key.substr(begin, dot - begin));
    begin = dot + 1;
  }
  out.push_back(key.substr(begin));
  return out;
}

/// Calls for the parts of keys in a tree: open(name, depth), leaf(setting, depth), close(depth).
template <class Open, class Leaf, class Close>
void walk(const std::vector<Setting>& list, Open open, Leaf leaf, Close close) {
  std::vector<std::string> path;
  const auto leave = [&](std::size_t depth) {
    while (path.size() > depth) {
      path.pop_back();
      close(path.size());
    }
  };
  for (const Setting& setting : list) {
    const std::vector<std::string> parts = parts_of(setting.key);
    std::size_t common = 0;
    while (common < path.size() && common + 1 < parts.size() && path[common] == parts[common]) ++common;
    leave(common);
    for (; common + 1 < parts.size(); ++common) {
      open(parts[common], common);
      path.push_back(parts[common]);
    }
    leaf(setting, path.size());
  }
  leave(0);
}

std::string range_text(const Setting& setting) {
  const std::vector<std::string>& choices = choices_of(setting.key);
  std::string out;
  for (const std::string& choice : choices) out += (out.empty() ? "" : ", ") + choice;
  if (!choices.empty()) return out;
  const std::optional<Range> range = range_of(setting.key);
  return range ? range->text() : "";
}

std::string comment_of(const Setting& setting) {
  std::string out;
  if (setting.unit != "-") out += fmt::format("[{}] ", setting.unit);
  out += setting.meaning;
  if (const std::string range = range_text(setting); !range.empty()) out += fmt::format(" ({})", range);
  return out;
}

bool has_value(const Settings& settings, const Setting& setting) { return setting.has_default || settings.given.contains(setting.key); }

constexpr const char* markdown_head = R"(# Settings

Made by `kilvo config show --markdown > docs/parameters.md` from the structs that hold the settings; a test keeps it up to date.

A configuration file is YAML, one map per section; a dot in a name is one level deeper (`lidar.T_imu_lidar.p`). What has no default
describes the robot and must be in the file when the sensor it belongs to is used; the rest is tuning and rarely needed. A rotation `R` may
also be written as `q: [x, y, z, w]` or as `rpy: [roll, pitch, yaw]` (rad, about fixed axes). One setting is
changed on the command line by `--set lidar.voxel_size=0.2`, where the value is YAML too. `kilvo config show FILE` prints all settings as
they would be used, `kilvo config check FILE` finds mistakes: an unknown name, a wrong type, a number out of range, a rotation that is
not one (`R^T R` must be the identity within 0.001), a link or joint that the URDF does not have are errors that name file, line, setting
and the nearest valid name. Files for several robots are in `config/robots`, for public recordings in `config/datasets`.
)";

}  // namespace

std::string settings_yaml(const Settings& settings) {
  Settings copy = settings;
  std::string out;
  const auto indent = [](std::size_t depth) { return std::string(2 * depth, ' '); };
  walk(
      list_settings(copy),
      [&](const std::string& name, std::size_t depth) {
        if (depth == 0 && !out.empty()) out += "\n";
        out += fmt::format("{}{}:\n", indent(depth), name);
      },
      [&](const Setting& setting, std::size_t depth) {
        const bool known = has_value(settings, setting);
        const std::string line =
            fmt::format("{}{}{}: {}", indent(depth), known ? "" : "# ", setting.name(), known ? value_text(setting.value) : "(not set)");
        // A long value has its comment above, so that it can be seen.
        constexpr std::size_t longest = 60;
        const std::string comment = comment_of(setting);
        out += line.size() > longest ? fmt::format("{}# {}\n{}\n", indent(depth), comment, line)
                                     : fmt::format("{:<40}  # {}\n", line, comment);
      },
      [](std::size_t) {});
  return out;
}

std::string settings_json(const Settings& settings) {
  Settings copy = settings;
  std::vector<Setting> list = list_settings(copy);
  std::erase_if(list, [&](const Setting& s) { return !has_value(settings, s); });
  std::string out = "{";
  const auto comma = [&out] {
    if (out.back() != '{') out += ", ";
  };
  walk(
      list,
      [&](const std::string& name, std::size_t) {
        comma();
        out += fmt::format("\"{}\": {{", name);
      },
      [&](const Setting& setting, std::size_t) {
        comma();
        out += fmt::format("\"{}\": {}", setting.name(), value_text(setting.value));
      },
      [&](std::size_t) { out += "}"; });
  return out + "}";
}

namespace {

std::string markdown_row(const Setting& s) {
  std::string values = range_text(s);
  values = values.empty() ? type_text(s.value) : choices_of(s.key).empty() ? fmt::format("{}, {}", type_text(s.value), values) : values;
  return fmt::format("| `{}` | {} | {} | {} | {} |\n", s.key, s.has_default ? fmt::format("`{}`", value_text(s.value)) : "", s.unit, values,
                     s.meaning);
}

constexpr const char* markdown_columns = "| setting | default | unit | values | meaning |\n|---|---|---|---|---|\n";

}  // namespace

std::string settings_markdown() {
  Settings defaults;
  const std::vector<Setting> list = list_settings(defaults);
  std::string robot, common, advanced, section;
  for (const Setting& s : list) {
    if (!s.has_default) {
      robot += markdown_row(s);
    } else if (!s.advanced) {
      common += markdown_row(s);
    } else {
      const std::string its_section = s.key.substr(0, s.key.find('.'));
      if (its_section != section) advanced += fmt::format("\n### {}\n{}", its_section, markdown_columns);
      section = its_section;
      advanced += markdown_row(s);
    }
  }
  return fmt::format(
      "{}\n## The robot\nNo defaults: required for the sensors that are used ([your robot](your-robot.md)).\n\n{}{}"
      "\n## Often changed\n{}{}\n## Advanced\nFor who knows the method: the defaults hold for every robot tested.\n{}",
      markdown_head, markdown_columns, robot, markdown_columns, common, advanced);
}

}  // namespace kilvo::lab
