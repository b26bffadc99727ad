#include "lab/settings/check_settings.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/settings/nearest.hpp"
#include "lab/settings/problems.hpp"
#include "lab/settings/setting_list.hpp"
#include "lab/settings/urdf_names.hpp"

namespace kilvo::lab {
namespace {

std::string joined(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

[[noreturn]] void refuse(const Settings& s, const std::string& key, const std::string& why) {
  const auto given = s.given.find(key);
  throw ConfigError(fmt::format("{}{}: {}", given == s.given.end() ? "" : given->second + ": ", key, why));
}

void check_value(const Settings& s, const Setting& setting) {
  const std::optional<Range> range = range_of(setting.key);
  const auto check_number = [&](double value) {
    if (range && !range->contains(value)) refuse(s, setting.key, fmt::format("must be {}, not {}", range->text(), value));
  };
  if (const auto* number = std::get_if<double*>(&setting.value)) check_number(**number);
  if (const auto* number = std::get_if<int*>(&setting.value)) check_number(**number);
  if (const auto* vector = std::get_if<Eigen::Vector3d*>(&setting.value)) {
    for (const double number : **vector) check_number(number);
  }
  const std::vector<std::string>& choices = choices_of(setting.key);
  const auto* text = std::get_if<std::string*>(&setting.value);
  if (text != nullptr && !choices.empty() && std::ranges::find(choices, **text) == choices.end()) {
    refuse(s, setting.key, fmt::format("must be one of {}, not '{}', nearest is {}", joined(choices), **text, nearest(**text, choices)));
  }
}

/// Names of letters, digits and _, none of them empty or with a digit first; / between them.
bool is_ros_name(const std::string& name) {
  char before = '/';
  for (const char c : name) {
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_', is_digit = c >= '0' && c <= '9';
    if (before == '/' ? !is_letter : !(is_letter || is_digit || c == '/')) return false;
    before = c;
  }
  return before != '/';
}

void check_together(const Settings& s, Problems& problems) {
  const auto complain = [&](const std::string& key, const std::string& why) { problems.collect([&] { refuse(s, key, why); }); };
  // Which of the two a user touched is where to point at.
  const auto touched = [&s](const char* one, const char* other) { return s.given.contains(one) ? one : other; };
  const double cell = s.estimator.lidar.voxel_size, voxel = s.estimator.map.voxel_size;
  if (cell > voxel / 4 * (1 + 1e-9)) {
    complain(touched("lidar.voxel_size", "map.voxel_size"),
             fmt::format("lidar.voxel_size ({}) must be at most a quarter of map.voxel_size ({})", cell, voxel));
  }
  const LidarMount& lidar = s.robot.lidar;
  if (lidar.min_range >= lidar.max_range) {
    complain(touched("lidar.min_range", "lidar.max_range"),
             fmt::format("lidar.min_range ({}) must be below lidar.max_range ({})", lidar.min_range, lidar.max_range));
  }
  const std::vector<double>& body = lidar.own_body;
  if (body.size() % 6 != 0) complain("lidar.own_body", fmt::format("must have 6 numbers for each box, not {} in all", body.size()));
  for (std::size_t k = 0; k + 6 <= body.size(); k += 6) {
    for (std::size_t axis = k; axis < k + 3; ++axis)
      if (!(body[axis] < body[axis + 3]))
        complain("lidar.own_body", fmt::format("box {}: the least corner ({:g}) must be below the greatest ({:g}) along {}", k / 6 + 1,
                                               body[axis], body[axis + 3], "xyz"[axis - k]));
  }
  const MapConfig& map = s.estimator.map;
  if (map.full_points < map.min_points) {
    complain(touched("map.full_points", "map.min_points"),
             fmt::format("map.full_points ({}) must not be below map.min_points ({})", map.full_points, map.min_points));
  }
  constexpr double no_lens = 1000;
  for (const double k : s.robot.camera.distortion) {
    if (std::abs(k) > no_lens) complain("camera.distortion", fmt::format("must be numbers of a lens, not {:g}", k));
  }
  if (!is_ros_name(s.live.name))
    complain("live.name", fmt::format("must be a name of ROS (letters, digits and _; / between names), not '{}'", s.live.name));
  const std::size_t n = s.robot.camera.distortion.size();
  const bool radtan = s.robot.camera.model == "pinhole_radtan";
  if (n != 0 && n != 4 && !(radtan && n == 5)) {
    complain("camera.distortion", fmt::format("must have {} numbers for {}, not {}", radtan ? "4 or 5" : "4", s.robot.camera.model, n));
  }
}

void check_names(const Settings& s, Problems& problems) {
  if (s.robot.urdf.empty()) return;
  if (s.robot.urdf.find("<xacro:") != std::string::npos)
    refuse(s, "robot.urdf", fmt::format("{} is not expanded: xacro FILE.urdf.xacro > FILE.urdf", s.urdf_file));
  const UrdfNames names = find_urdf_names(s.robot.urdf);
  if (names.links.empty()) refuse(s, "robot.urdf", fmt::format("{} has no links: not a URDF file", s.urdf_file));
  // The reader of URDFs descends link by link, and its stack ends at some thousands of them.
  constexpr std::size_t most_links = 1000;
  if (names.links.size() > most_links)
    refuse(s, "robot.urdf", fmt::format("{} has {} links, at most {} are read", s.urdf_file, names.links.size(), most_links));
  const auto check = [&](const std::string& key, const std::string& name, const std::vector<std::string>& valid, const char* what) {
    if (!name.empty() && std::ranges::find(valid, name) == valid.end()) {
      problems.collect(
          [&] { refuse(s, key, fmt::format("{} has no {} '{}', nearest is '{}'", s.urdf_file, what, name, nearest(name, valid))); });
    }
  };
  for (const Foot& foot : s.robot.feet) check("robot.feet", foot.link, names.links, "link");
  const auto& feet = s.robot.feet;
  if (!feet[0].link.empty() && feet[0].link == feet[1].link)
    problems.collect([&] { refuse(s, "robot.feet", fmt::format("both feet are on link {}", feet[0].link)); });
  check("imu.T_link_imu.link", s.robot.imu.link, names.links, "link");
  check("legs.gyro_link", s.leg_clock.gyro_link, names.links, "link");
  for (const std::string& joint : s.robot.locked_joints) check("robot.locked_joints", joint, names.joints, "joint");
  for (const auto& [joint, reading] : s.robot.joints) check("robot.joints", joint, names.joints, "joint");
}

// What a sensor cannot do without. Keys with defaults are not in it.
std::vector<std::string> required_keys(const Settings& s, Sensor sensor) {
  switch (sensor) {
    case Sensor::imu:
      return {"imu.topic"};
    case Sensor::legs:
      if (s.robot.legs.type == "feet") return {"legs.topic", "legs.T_imu_feet.p", "legs.T_imu_feet.R"};
      return {"legs.topic", "robot.urdf", "robot.feet", "imu.T_link_imu.link", "imu.T_link_imu.p", "imu.T_link_imu.R"};
    case Sensor::lidar:
      return {"lidar.topic", "lidar.T_imu_lidar.p", "lidar.T_imu_lidar.R"};
    case Sensor::camera:
      return {"camera.topic",
              "camera.T_imu_camera.p",
              "camera.T_imu_camera.R",
              "camera.width",
              "camera.height",
              "camera.fx",
              "camera.fy",
              "camera.cx",
              "camera.cy"};
  }
  return {};
}

}  // namespace

void check_settings(const Settings& settings) {
  Problems problems;
  Settings copy = settings;
  for (const Setting& setting : list_settings(copy)) {
    if (settings.given.contains(setting.key)) problems.collect([&] { check_value(settings, setting); });
  }
  if (problems.none()) check_together(settings, problems);
  problems.collect([&] { check_names(settings, problems); });
  problems.collect([&] {
    if (settings.leg_clock.clock == "estimated" && settings.robot.legs.type == "feet")
      refuse(settings, "legs.clock", "estimated needs joints: two feet have no angular rate");
  });
  problems.report();
}

void require_complete(const Settings& settings, std::span<const Sensor> used) {
  Problems problems;
  for (const Sensor sensor : used) {
    for (const std::string& key : required_keys(settings, sensor)) {
      if (!settings.given.contains(key)) {
        // The file is the one that any other of the settings came from.
        std::string file;
        for (const auto& [other, where] : settings.given) {
          if (!where.starts_with("--set")) file = where.substr(0, where.rfind(':')) + ": ";
        }
        problems.collect([&] {
          throw ConfigError(fmt::format("{}{} is missing: the sensor '{}' cannot be used without it", file, key, name_of(sensor)));
        });
      }
    }
  }
  problems.report();
}

}  // namespace kilvo::lab
