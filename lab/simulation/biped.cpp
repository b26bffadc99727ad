#include "lab/simulation/biped.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <numbers>

namespace kilvo::lab {
namespace {

using std::numbers::pi;
constexpr std::array leg_names{"hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll"};
constexpr std::array leg_axes{1, 0, 2, 1, 1, 0};  // x, y or z of each joint

SO3 turn_about(int axis, double angle) { return SO3::Exp(Eigen::Vector3d::Unit(axis) * angle); }

JointLimit limit_of(Side side, int joint) {
  const JointLimit limit = leg_limits()[static_cast<std::size_t>(joint)];
  if (leg_axes[static_cast<std::size_t>(joint)] == 1 || side == Side::left) return limit;
  return {-limit.upper, -limit.lower};
}

std::string check_limits(Side side, const LegAngles& q) {
  for (int i = 0; i < leg_joint_count; ++i) {
    const double angle = q[static_cast<std::size_t>(i)];
    const JointLimit limit = limit_of(side, i);
    if (!(angle >= limit.lower && angle <= limit.upper)) {
      return fmt::format("{}_joint would have to turn to {:.1f} degrees, its limits are {:.1f} and {:.1f}",
                         leg_names[static_cast<std::size_t>(i)], angle * 180 / pi, limit.lower * 180 / pi, limit.upper * 180 / pi);
    }
  }
  return "";
}

std::string joint_xml(const std::string& name, const std::string& parent, const std::string& child, const Eigen::Vector3d& origin, int axis,
                      const JointLimit& limit) {
  const Eigen::Vector3d a = Eigen::Vector3d::Unit(axis);
  return fmt::format(
      "  <joint name=\"{}\" type=\"revolute\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    <origin xyz=\"{} {} {}\" rpy=\"0 "
      "0 "
      "0\"/>\n    <axis xyz=\"{} {} {}\"/>\n    <limit lower=\"{}\" upper=\"{}\" effort=\"100\" velocity=\"20\"/>\n  </joint>\n  <link "
      "name=\"{}\"/>\n",
      name, parent, child, origin.x(), origin.y(), origin.z(), a.x(), a.y(), a.z(), limit.lower, limit.upper, child);
}

std::string leg_xml(const BipedShape& shape, Side side) {
  const std::string prefix = side == Side::left ? "left_" : "right_";
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const std::array<Eigen::Vector3d, leg_joint_count> origins{
      shape.hip_of(side), zero, zero, Eigen::Vector3d(0, 0, -shape.thigh), Eigen::Vector3d(0, 0, -shape.shin), zero};
  std::string parent = "pelvis", out;
  for (int i = 0; i < leg_joint_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const std::string link = prefix + leg_names[k] + "_link";
    out += joint_xml(prefix + leg_names[k] + "_joint", parent, link, origins[k], leg_axes[k], limit_of(side, i));
    parent = link;
  }
  return out;
}

}  // namespace

SE3 BipedShape::lidar_mount() { return {SO3::Exp({0, 0.04, 0}) * SO3::Exp({pi, 0, 0}), {0.0003, 0, 0.416}}; }

std::array<Eigen::Vector3d, 4> BipedShape::sole() const {
  const double y = sole_half_width, z = -sole_depth;
  return {Eigen::Vector3d(heel, y, z), {heel, -y, z}, {toe, y, z}, {toe, -y, z}};
}

const std::array<JointLimit, leg_joint_count>& leg_limits() {
  static constexpr std::array<JointLimit, leg_joint_count> limits{
      {{-2.53, 2.53}, {-0.52, 1.6}, {-2.75, 2.75}, {0.02, 2.88}, {-1.2, 0.9}, {-0.35, 0.35}}};
  return limits;
}

const std::array<std::string, 2 * leg_joint_count + 1>& joint_names() {
  static const std::array<std::string, 2 * leg_joint_count + 1> names = [] {
    std::array<std::string, 2 * leg_joint_count + 1> out;
    for (std::size_t i = 0; i < leg_joint_count; ++i) {
      out[i] = std::string("left_") + leg_names[i] + "_joint";
      out[leg_joint_count + i] = std::string("right_") + leg_names[i] + "_joint";
    }
    out.back() = "waist_yaw_joint";
    return out;
  }();
  return names;
}

LegSolution solve_leg(const BipedShape& shape, Side side, const SE3& T_pelvis_foot) {
  LegSolution out;
  // The hip as the ankle sees it. Its direction gives the ankle's angles, its distance the knee's.
  const Eigen::Vector3d r = T_pelvis_foot.R.inverse() * (shape.hip_of(side) - T_pelvis_foot.p);
  const double distance = r.norm(), a = shape.thigh, b = shape.shin;
  if (!(distance < a + b) || distance < std::abs(a - b) + 1e-3) {
    out.fault = fmt::format("the {} foot is {:.3f} m from its hip, the leg reaches {:.3f} m", side == Side::left ? "left" : "right",
                            distance, a + b);
    return out;
  }
  const double knee = pi - std::acos((a * a + b * b - distance * distance) / (2 * a * b));
  const double in_shin = std::asin(a * std::sin(knee) / distance);  // between the shin and the line from ankle to hip
  const double ankle_roll = std::atan2(r.y(), r.z());
  const double ankle_pitch = -std::atan2(r.x(), std::hypot(r.y(), r.z())) - in_shin;
  const Eigen::Matrix3d hip = (T_pelvis_foot.R * turn_about(0, -ankle_roll) * turn_about(1, -ankle_pitch - knee)).matrix();
  const double hip_pitch = std::atan2(hip(0, 2), hip(2, 2)), hip_roll = std::asin(std::clamp(-hip(1, 2), -1.0, 1.0));
  const double hip_yaw = std::atan2(hip(1, 0), hip(1, 1));
  out.angles = {hip_pitch, hip_roll, hip_yaw, knee, ankle_pitch, ankle_roll};
  out.fault = check_limits(side, out.angles);
  return out;
}

SE3 foot_in_pelvis(const BipedShape& shape, Side side, const LegAngles& q) {
  const SE3 thigh{turn_about(1, q[0]) * turn_about(0, q[1]) * turn_about(2, q[2]), shape.hip_of(side)};
  const SE3 shin{turn_about(1, q[3]), {0, 0, -shape.thigh}};
  const SE3 foot{turn_about(1, q[4]) * turn_about(0, q[5]), {0, 0, -shape.shin}};
  return thigh * shin * foot;
}

std::string urdf_of(const BipedShape& shape) {
  std::string out =
      "<?xml version=\"1.0\"?>\n<!-- The humanoid that `kilvo simulate` walks: kinematics only. Metres, radians; x forward, y left, z up.\n"
      "     Made from lab/simulation/biped.cpp; a test holds the two together. -->\n<robot name=\"kilvo_sim\">\n  <link "
      "name=\"pelvis\"/>\n";
  out += leg_xml(shape, Side::left) + leg_xml(shape, Side::right);
  out += joint_xml("waist_yaw_joint", "pelvis", "torso_link", shape.waist, 2, {-2.6, 2.6});
  return out + "</robot>\n";
}

}  // namespace kilvo::lab
