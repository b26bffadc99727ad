#include "lab/settings/value.hpp"

#include <charconv>
#include <cmath>
#include <fmt/core.h>
#include <limits>

#include "lab/settings/nearest.hpp"

namespace kilvo::lab {
namespace {

/// How far R^T R may be from the identity: extrinsics are copied with four decimals and more.
constexpr double rotation_tolerance = 1e-3;

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

std::string shown(const YAML::Node& node) {
  if (node.IsNull()) return "nothing";
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return fmt::format("a list of {}", node.size());
  const std::string& text = node.Scalar();
  constexpr std::size_t most = 60;
  return "'" + (text.size() > most ? text.substr(0, most) + "..." : text) + "'";
}

[[noreturn]] void refuse(const YAML::Node& node, const std::string& wanted) {
  throw BadValue(node, fmt::format("must be {}, not {}", wanted, shown(node)));
}

// A quoted number is a text: yaml-cpp marks it with the tag "!".
bool is_plain(const YAML::Node& node) { return node.IsScalar() && node.Tag() != "!"; }

double read_number(const YAML::Node& node) {
  if (!is_plain(node)) refuse(node, "a number");
  const std::string& text = node.Scalar();
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) refuse(node, "a number");
  if (!std::isfinite(value)) refuse(node, "a finite number");
  return value;
}

int read_whole_number(const YAML::Node& node) {
  if (!is_plain(node)) refuse(node, "a whole number");
  const double value = read_number(node);
  if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max()) refuse(node, "a whole number");
  return static_cast<int>(value);
}

bool read_bool(const YAML::Node& node) {
  if (is_plain(node) && node.Scalar() == "true") return true;
  if (is_plain(node) && node.Scalar() == "false") return false;
  refuse(node, "true or false");
}

std::string read_text(const YAML::Node& node) {
  // Empty quotes are a text: the settings that may be empty are printed so.
  if (!node.IsScalar() || (node.Scalar().empty() && is_plain(node))) refuse(node, "a text");
  return node.Scalar();
}

std::vector<double> read_numbers(const YAML::Node& node, std::optional<std::size_t> count, const std::string& wanted) {
  if (!node.IsSequence() || (count && node.size() != *count)) refuse(node, wanted);
  std::vector<double> out;
  for (const YAML::Node& entry : node) out.push_back(read_number(entry));
  return out;
}

Eigen::Vector3d read_vector(const YAML::Node& node) {
  constexpr double farthest = 10000;  // m; millimetres are still answered by who holds them against a recording
  const Eigen::Vector3d p(read_numbers(node, 3, "a list of 3 numbers").data());
  if (p.cwiseAbs().maxCoeff() > farthest)
    throw BadValue(node,
                   fmt::format("must be metres on a robot, at most {:g} each, not [{:g}, {:g}, {:g}]", farthest, p.x(), p.y(), p.z()));
  return p;
}

SO3 read_rotation(const YAML::Node& node) {
  const std::vector<double> n = read_numbers(node, 9, "a list of 9 numbers (a rotation matrix, row by row)");
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(n.data());
  const double off = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= rotation_tolerance)) {
    throw BadValue(
        node, fmt::format("is not a rotation: R^T R differs from the identity by {:.3g}, at most {} is allowed", off, rotation_tolerance));
  }
  if (R.determinant() < 0) throw BadValue(node, "is not a rotation but a reflection: its determinant is -1");
  return SO3::nearest(R);
}

std::vector<std::string> read_texts(const YAML::Node& node) {
  if (!node.IsSequence()) refuse(node, "a list of texts");
  std::vector<std::string> out;
  for (const YAML::Node& entry : node) out.push_back(read_text(entry));
  return out;
}

void read_foot_entry(const YAML::Node& name, const YAML::Node& value, Foot& foot) {
  const std::vector<std::string> keys{"name", "link", "sole"};
  const std::string key = name.IsScalar() ? name.Scalar() : std::string();
  if (key == "name") {
    foot.name = read_text(value);
  } else if (key == "link") {
    foot.link = read_text(value);
  } else if (key == "sole") {
    if (!value.IsSequence() || value.size() == 0) refuse(value, "a list of corner points [x, y, z]");
    foot.sole.clear();
    for (const YAML::Node& corner : value) foot.sole.push_back(read_vector(corner));
  } else {
    throw BadValue(name, fmt::format("{}: a foot has no such entry, nearest is '{}'", shown(name), nearest(key, keys)));
  }
}

std::array<Foot, 2> read_feet(const YAML::Node& node) {
  if (!node.IsSequence() || node.size() != 2) refuse(node, "a list of 2 feet");
  std::array<Foot, 2> out;
  for (const YAML::Node& entry : node) {
    if (!entry.IsMap()) refuse(entry, "a foot {name, link, sole}");
    Foot foot;
    for (const auto& pair : entry) read_foot_entry(pair.first, pair.second, foot);
    if (foot.name != "left" && foot.name != "right") throw BadValue(entry, "the name of a foot must be left or right");
    if (foot.link.empty()) throw BadValue(entry, fmt::format("the {} foot has no link", foot.name));
    Foot& place = out[foot.name == "left" ? 0 : 1];
    if (!place.name.empty()) throw BadValue(entry, fmt::format("there are two {} feet", foot.name));
    place = foot;
  }
  return out;
}

JointReading read_joint(const YAML::Node& node) {
  constexpr double most = 1000;  // rad
  if (!node.IsMap()) refuse(node, "{from, sign, zero}");
  const std::vector<std::string> keys{"from", "sign", "zero"};
  JointReading out;
  for (const auto& pair : node) {
    const std::string key = pair.first.IsScalar() ? pair.first.Scalar() : std::string();
    if (key == "from") {
      out.from = read_text(pair.second);
    } else if (key == "sign") {
      out.sign = read_number(pair.second);
      if (std::abs(out.sign) != 1) refuse(pair.second, "1, or -1 where it turns the other way");
    } else if (key == "zero") {
      out.zero = read_number(pair.second);
      if (!(std::abs(out.zero) <= most)) refuse(pair.second, "an angle in rad");
    } else {
      throw BadValue(pair.first, fmt::format("{}: a joint has no such entry, nearest is '{}'", shown(pair.first), nearest(key, keys)));
    }
  }
  return out;
}

std::map<std::string, JointReading> read_joints(const YAML::Node& node) {
  if (!node.IsMap()) refuse(node, "a map of joints, JOINT: {from, sign, zero}");
  std::map<std::string, JointReading> out;
  for (const auto& pair : node) {
    if (!out.emplace(read_text(pair.first), read_joint(pair.second)).second)
      throw BadValue(pair.first, fmt::format("{} is given twice", shown(pair.first)));
  }
  return out;
}

}  // namespace

void read_value(const YAML::Node& node, const SettingValue& to) {
  std::visit(Overloaded{
                 [&](double* x) { *x = read_number(node); },
                 [&](int* x) { *x = read_whole_number(node); },
                 [&](bool* x) { *x = read_bool(node); },
                 [&](std::string* x) { *x = read_text(node); },
                 [&](std::vector<double>* x) { *x = read_numbers(node, std::nullopt, "a list of numbers"); },
                 [&](std::vector<std::string>* x) { *x = read_texts(node); },
                 [&](Eigen::Vector3d* x) { *x = read_vector(node); },
                 [&](SO3* x) { *x = read_rotation(node); },
                 [&](std::array<Foot, 2>* x) { *x = read_feet(node); },
                 [&](std::map<std::string, JointReading>* x) { *x = read_joints(node); },
             },
             to);
}

std::string type_text(const SettingValue& value) {
  constexpr const char* texts[] = {"number",        "whole number", "true or false",         "text",           "list of numbers",
                                   "list of texts", "3 numbers",    "9 numbers, row by row", "list of 2 feet", "map of joints"};
  static_assert(std::size(texts) == std::variant_size_v<SettingValue>);
  return texts[value.index()];
}

}  // namespace kilvo::lab
