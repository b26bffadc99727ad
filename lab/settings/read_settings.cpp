#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <fstream>
#include <set>
#include <sstream>

#include "lab/contacts/contact_methods.hpp"
#include "lab/settings/check_settings.hpp"
#include "lab/settings/nearest.hpp"
#include "lab/settings/pose_forms.hpp"
#include "lab/settings/problems.hpp"
#include "lab/settings/urdf_names.hpp"
#include "lab/settings/value.hpp"

namespace kilvo::lab {
namespace {

namespace fs = std::filesystem;

// A configuration is a page or two, a URDF some hundred kilobytes; whoever names a recording here shall hear of it at once.
constexpr std::uintmax_t most_bytes = 16 << 20;

std::string read_file(const fs::path& path, const std::string& what) {
  std::error_code error;
  if (!fs::exists(path, error)) throw ConfigError(fmt::format("{}: no such {}", path.string(), what));
  if (!fs::is_regular_file(path, error) && !fs::is_directory(path, error))
    throw ConfigError(fmt::format("{}: not a file that a {} could be read from", path.string(), what));
  if (fs::is_directory(path, error)) throw ConfigError(fmt::format("{}: a folder, not a {}", path.string(), what));
  std::ifstream in(path, std::ios::binary);
  if (!in) throw ConfigError(fmt::format("{}: cannot be read", path.string()));
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) > most_bytes)
    throw ConfigError(fmt::format("{}: too large for a {}", path.string(), what));
  std::ostringstream text;
  text << in.rdbuf();
  if (text.str().find('\0') != std::string::npos) throw ConfigError(fmt::format("{}: not a text file", path.string()));
  return std::move(text).str();
}

std::string joined(const std::string& prefix, const std::string& name) { return prefix.empty() ? name : prefix + "." + name; }

/// Walks a YAML tree and stores what it finds; says where.
class Reader {
 public:
  Reader(Settings& settings, Problems& problems) : settings_(settings), problems_(problems), list_(list_settings(settings)) {
    for (const Setting& s : list_) {
      names_.push_back(s.key);
      for (std::size_t dot = s.key.find('.'); dot != std::string::npos; dot = s.key.find('.', dot + 1))
        sections_.insert(s.key.substr(0, dot));
    }
    names_.insert(names_.end(), sections_.begin(), sections_.end());
  }

  void read_document(const std::string& yaml, const std::string& name) {
    source_ = name;
    const YAML::Node root = load(yaml);
    if (!root.IsMap())
      throw ConfigError(fmt::format("{}: no settings in it: a map of sections (robot, imu, lidar, ...) is expected", name));
    read_section(root, "");
  }

  void read_override(const std::string& text) {
    source_ = "--set " + text;
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      throw ConfigError(fmt::format("{}: must be KEY=VALUE, as in lidar.voxel_size=0.2", source_));
    is_override_ = true;
    read_node(text.substr(0, equals), load(text.substr(equals + 1)), 0);
  }

 private:
  YAML::Node load(const std::string& yaml) const {
    try {
      const std::vector<YAML::Node> documents = YAML::LoadAll(yaml);
      if (documents.size() > 1) throw ConfigError(fmt::format("{}: more than one YAML document", source_));
      return documents.empty() ? YAML::Node() : documents.front();
    } catch (const YAML::Exception& error) {
      throw ConfigError(fmt::format("{}: not valid YAML: {}", place(error.mark.line + 1), error.msg));
    }
  }

  std::string place(int line) const { return is_override_ || line <= 0 ? source_ : fmt::format("{}:{}", source_, line); }

  void read_section(const YAML::Node& map, const std::string& prefix) {
    std::set<std::string> seen;
    for (const auto& pair : map) {
      const int line = pair.first.Mark().line + 1;
      const std::string name = pair.first.IsScalar() ? pair.first.Scalar() : std::string("?");
      const std::string key = joined(prefix, name);
      problems_.collect([&] {
        if (!seen.insert(name).second) throw ConfigError(fmt::format("{}: {}: given twice", place(line), key));
        read_node(key, pair.second, line);
      });
    }
  }

  void read_node(const std::string& key, const YAML::Node& node, int line) {
    const auto setting = std::ranges::find(list_, key, &Setting::key);
    if (setting != list_.end()) {
      read_into(*setting, "R", node, line);
    } else if (const Setting* rotation = rotation_of(key)) {
      read_into(*rotation, key.substr(key.rfind('.') + 1), node, line);
    } else if (!sections_.contains(key)) {
      refuse_unknown(key, node, line);
    } else if (node.IsMap()) {
      read_section(node, key);
    } else if (!node.IsNull()) {  // a section with nothing in it is fine
      if (is_pose(key)) throw ConfigError(fmt::format("{}: {}: {}{}", place(line), key, pose_forms_text(), converted(node)));
      throw ConfigError(fmt::format("{}: {}: must be a map of settings", place(line), key));
    }
  }

  /// `form`: how a rotation is written.
  void read_into(const Setting& setting, const std::string& form, const YAML::Node& node, int line) {
    const auto* rotation = std::get_if<SO3*>(&setting.value);
    if (rotation != nullptr && settings_.given.contains(setting.key) && !is_override_)
      throw ConfigError(fmt::format("{}: {}: the rotation is given twice: one of R, q, rpy", place(line), setting.key));
    try {
      if (rotation != nullptr) {
        **rotation = read_rotation_form(form, node);
      } else {
        read_value(node, setting.value);
      }
    } catch (const BadValue& bad) {
      const std::string key = rotation == nullptr ? setting.key : setting.key.substr(0, setting.key.rfind('.') + 1) + form;
      throw ConfigError(fmt::format("{}: {}: {}", place(bad.line > 0 ? bad.line : line), key, bad.what()));
    }
    settings_.given[setting.key] = place(line);
  }

  /// The rotation that lidar.T_imu_lidar.q or .rpy is another form of.
  const Setting* rotation_of(const std::string& key) const {
    const std::size_t dot = key.rfind('.');
    if (dot == std::string::npos || (key.substr(dot) != ".q" && key.substr(dot) != ".rpy")) return nullptr;
    const auto setting = std::ranges::find(list_, key.substr(0, dot) + ".R", &Setting::key);
    return setting == list_.end() || !std::holds_alternative<SO3*>(setting->value) ? nullptr : &*setting;
  }

  bool is_pose(const std::string& section) const { return std::ranges::find(list_, section + ".R", &Setting::key) != list_.end(); }

  // What a matrix of a pose would be.
  static std::string converted(const YAML::Node& node) {
    try {
      const auto pose = node.IsSequence() ? matrix_pose_text(node) : std::nullopt;
      return pose ? "; the matrix given is " + *pose : "";
    } catch (const std::exception&) {  // no numbers
      return "";
    }
  }

  [[noreturn]] void refuse_unknown(const std::string& key, const YAML::Node& node, int line) const {
    const std::size_t dot = key.rfind('.');
    const std::string section = dot == std::string::npos ? "" : key.substr(0, dot + 1);
    const std::optional<std::string> opposite = opposite_pose(key.substr(section.size()));
    if (opposite && sections_.contains(section + *opposite)) {
      std::string conversion;
      try {
        conversion = fmt::format("; the inverse of the pose given is {}: {}", *opposite, inverse_pose_text(node));
      } catch (const BadValue&) {  // then it has other faults as well
      }
      throw ConfigError(fmt::format("{}: {}: must be {}, which takes a point of the second frame into the first{}", place(line), key,
                                    section + *opposite, conversion));
    }
    if (!section.empty() && is_pose(section.substr(0, section.size() - 1)))
      throw ConfigError(fmt::format("{}: {}: no such setting: {}", place(line), key, pose_forms_text()));
    throw ConfigError(fmt::format("{}: {}: no such setting, nearest is {}", place(line), key, nearest_name(key)));
  }

  // A right name in the wrong section is a likelier slip than any wrong letter.
  std::string nearest_name(const std::string& key) const {
    const std::string name = key.substr(key.rfind('.') + 1);
    for (const Setting& s : list_) {
      if (s.name() == name) return s.key;
    }
    return nearest(key, names_);
  }

  Settings& settings_;
  Problems& problems_;
  std::vector<Setting> list_;
  std::set<std::string> sections_;
  std::vector<std::string> names_;  // of settings and sections
  std::string source_;
  bool is_override_ = false;
};

void read_urdf(Settings& s, const fs::path& folder) {
  const auto given = s.given.find("robot.urdf");
  if (given == s.given.end()) return;
  // A path in --set is one from where the user stands.
  const bool from_command_line = given->second.starts_with("--set");
  const fs::path path = fs::weakly_canonical((from_command_line ? fs::current_path() : folder) / s.urdf_file);
  try {
    s.robot.urdf = read_file(path, "URDF file");
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: robot.urdf: {}", given->second, error.what()));
  }
  s.urdf_file = path.string();
}

}  // namespace

Settings parse_settings(const std::string& yaml, const std::string& name, const fs::path& folder, std::span<const std::string> overrides) {
  Settings settings;
  Problems problems;
  Reader reader(settings, problems);
  reader.read_document(yaml, name);
  for (const std::string& text : overrides) problems.collect([&] { reader.read_override(text); });
  problems.collect([&] { read_urdf(settings, folder); });
  problems.collect([&] { check_settings(settings); });
  problems.report();
  settings.estimator.legs.detector = contact_method(settings.estimator.legs.contact);
  return settings;
}

Settings load_settings(const fs::path& file, std::span<const std::string> overrides) {
  return parse_settings(read_file(file, "configuration file"), file.string(), fs::absolute(file).parent_path(), overrides);
}

}  // namespace kilvo::lab
