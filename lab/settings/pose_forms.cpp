#include "lab/settings/pose_forms.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fmt/core.h>
#include <numbers>

#include "lab/settings/value.hpp"

namespace kilvo::lab {
namespace {

std::vector<double> numbers_of(const YAML::Node& node) {
  std::vector<double> out;
  read_value(node, &out);
  return out;
}

SO3 read_quaternion(const YAML::Node& node) {
  const std::vector<double> n = numbers_of(node);
  if (n.size() != 4) throw BadValue(node, fmt::format("must be a quaternion of 4 numbers (x, y, z, w), not a list of {}", n.size()));
  const Eigen::Quaterniond q(n[3], n[0], n[1], n[2]);
  // Four decimals are common.
  constexpr double tolerance = 1e-3;
  if (!(std::abs(q.norm() - 1) <= tolerance))
    throw BadValue(node, fmt::format("is not a rotation: the quaternion's norm is {:.4g}, not 1", q.norm()));
  return SO3::nearest(q.normalized().toRotationMatrix());
}

SO3 read_roll_pitch_yaw(const YAML::Node& node) {
  const std::vector<double> n = numbers_of(node);
  if (n.size() != 3) throw BadValue(node, fmt::format("must be roll, pitch, yaw in radians, not a list of {}", n.size()));
  for (const double angle : n) {
    if (std::abs(angle) > 2 * std::numbers::pi) {
      throw BadValue(node, fmt::format("must be in radians: {:g} is more than a turn; {:g} degrees are {:.9g} radians", angle, angle,
                                       angle * std::numbers::pi / 180));
    }
  }
  return SO3::Exp(Eigen::Vector3d(0, 0, n[2])) * SO3::Exp(Eigen::Vector3d(0, n[1], 0)) * SO3::Exp(Eigen::Vector3d(n[0], 0, 0));
}

// Three rows as one list.
YAML::Node flattened(const YAML::Node& node) {
  if (!node.IsSequence() || node.size() != 3 || !node[0].IsSequence()) return node;
  YAML::Node out(YAML::NodeType::Sequence);
  for (const YAML::Node& row : node) {
    for (const YAML::Node& number : row) out.push_back(number);
  }
  return out;
}

}  // namespace

SO3 read_rotation_form(const std::string& form, const YAML::Node& node) {
  if (form == "q") return read_quaternion(node);
  if (form == "rpy") return read_roll_pitch_yaw(node);
  SO3 R;
  read_value(flattened(node), &R);
  return R;
}

std::optional<std::string> opposite_pose(const std::string& name) {
  if (!name.starts_with("T_")) return std::nullopt;
  const std::size_t middle = name.find('_', 2);
  if (middle == std::string::npos) return std::nullopt;
  return "T_" + name.substr(middle + 1) + "_" + name.substr(2, middle - 2);
}

std::string pose_forms_text() {
  return "a pose is {p: [x, y, z]} in metres with one of R: [9 numbers, row by row], q: [x, y, z, w], rpy: [roll, pitch, yaw] in radians";
}

std::optional<std::string> matrix_pose_text(const YAML::Node& matrix) {
  std::vector<double> n;
  for (const YAML::Node& entry : matrix) {
    const std::vector<double> row = entry.IsSequence() ? numbers_of(entry) : std::vector<double>{entry.as<double>()};
    n.insert(n.end(), row.begin(), row.end());
  }
  if (n.size() != 12 && n.size() != 16) return std::nullopt;
  std::string R;
  for (const std::size_t i : {0U, 1U, 2U, 4U, 5U, 6U, 8U, 9U, 10U}) R += fmt::format("{}{:.10g}", R.empty() ? "" : ", ", n[i]);
  return fmt::format("{{p: [{:.10g}, {:.10g}, {:.10g}], R: [{}]}}", n[3], n[7], n[11], R);
}

std::string inverse_pose_text(const YAML::Node& pose) {
  if (!pose.IsMap() || !pose["p"]) throw BadValue(pose, "must be a pose {p, R}");
  SE3 T;
  read_value(pose["p"], &T.p);
  for (const char* form : {"R", "q", "rpy"}) {
    if (pose[form]) T.R = read_rotation_form(form, pose[form]);
  }
  const SE3 inverse = T.inverse();
  const auto clean = [](double x) { return std::abs(x) < 1e-12 ? 0.0 : x; };  // what rounding has left of a zero
  const Eigen::Matrix3d R = inverse.R.matrix().unaryExpr(clean);
  std::string numbers;
  for (int i = 0; i < 9; ++i) numbers += fmt::format("{}{:.10g}", i == 0 ? "" : ", ", R(i / 3, i % 3));
  return fmt::format("{{p: [{:.10g}, {:.10g}, {:.10g}], R: [{}]}}", clean(inverse.p.x()), clean(inverse.p.y()), clean(inverse.p.z()),
                     numbers);
}

}  // namespace kilvo::lab
