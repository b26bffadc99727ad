// A biped that no factory built: every origin is turned, every axis oblique, the IMU sits above a waist, a shin is prismatic. Its URDF,
// and where its feet are by a plain product of matrices.
#pragma once

#include <Eigen/Geometry>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/robot.hpp"
#include "tests/helpers/random.hpp"

namespace kilvo::test {

struct BipedJoint {
  std::string name, parent, child, type;
  Eigen::Vector3d xyz, rpy, axis;
};

inline std::vector<BipedJoint> biped_joints() {
  std::vector<BipedJoint> out = {{"waist", "pelvis", "torso", "revolute", {0.02, -0.01, 0.1}, {0.1, -0.2, 0.3}, {0.1, 0.2, 1}}};
  for (const std::string side : {"left", "right"}) {
    const double s = side == "left" ? 1 : -1;
    std::string parent = "pelvis";
    for (int i = 1; i <= 6; ++i) {
      const std::string name = side + "_" + std::to_string(i);
      const char* type = i == 3 ? "prismatic" : i == 5 ? "continuous" : "revolute";
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(i % 3) + Eigen::Vector3d(0.1 * i, -0.05 * s, 0.2);
      out.push_back({name, parent, name + "_link", type, {0.01 * i, 0.03 * s, -0.12}, {0.1 * s, 0.05 * i, -0.2 * s}, axis});
      parent = name + "_link";
    }
    out.push_back({side + "_ankle", parent, side + "_foot", "fixed", {0.02, 0.01 * s, -0.04}, {0.3, 0.1, -0.4 * s}, {1, 0, 0}});
  }
  return out;
}

inline std::string biped_urdf() {
  std::ostringstream out;
  out.precision(17);
  out << "<robot name=\"biped\"><link name=\"pelvis\"/>";
  for (const BipedJoint& j : biped_joints()) {
    out << "<link name=\"" << j.child << "\"/><joint name=\"" << j.name << "\" type=\"" << j.type << "\"><parent link=\"" << j.parent
        << "\"/><child link=\"" << j.child << "\"/><origin xyz=\"" << j.xyz.transpose() << "\" rpy=\"" << j.rpy.transpose()
        << "\"/><axis xyz=\"" << j.axis.transpose() << "\"/><limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"1\"/></joint>";
  }
  out << "</robot>";
  return out.str();
}

inline Robot biped(Random& random) {
  Robot robot;
  robot.urdf = biped_urdf();
  robot.imu.link = "torso";
  robot.imu.T_link_imu = {random.rotation(), random.vector3(0.3)};
  robot.feet[0] = {"left", "left_foot", {}};
  robot.feet[1] = {"right", "right_foot", {}};
  for (Foot& foot : robot.feet) foot.sole = {{-0.06, 0.03, -0.05}, {-0.06, -0.03, -0.05}, {0.13, 0.04, -0.05}, {0.13, -0.04, -0.05}};
  return robot;
}

inline JointSample random_joints(Random& random) {
  JointSample s;
  JointNames::List names;
  s.t = time_from_ns(1'700'000'000'000'000'000);
  for (const BipedJoint& j : biped_joints()) {
    if (j.type == "fixed") continue;
    names.push_back(j.name);
    s.position.push_back(random.normal(0.5));
    s.velocity.push_back(random.normal(1));
  }
  s.names = names;
  return s;
}

/// The joints h seconds earlier and later, at the velocities of the sample.
inline std::pair<JointSample, JointSample> around(const JointSample& s, double h) {
  JointSample before = s, after = s;
  for (std::size_t j = 0; j < s.position.size(); ++j) {
    before.position[j] -= h * s.velocity[j];
    after.position[j] += h * s.velocity[j];
  }
  return {before, after};
}

inline Eigen::Isometry3d transform_of(const BipedJoint& j, const JointSample& s) {
  using Eigen::AngleAxisd;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(j.xyz);
  T.rotate(AngleAxisd(j.rpy.z(), Eigen::Vector3d::UnitZ()));
  T.rotate(AngleAxisd(j.rpy.y(), Eigen::Vector3d::UnitY()));
  T.rotate(AngleAxisd(j.rpy.x(), Eigen::Vector3d::UnitX()));
  for (std::size_t i = 0; i < s.names.size(); ++i) {
    if (s.names[i] != j.name) continue;
    const Eigen::Vector3d axis = j.axis.normalized();
    if (j.type == "prismatic") {
      T.translate(s.position[i] * axis);
    } else {
      T.rotate(AngleAxisd(s.position[i], axis));
    }
  }
  return T;
}

/// T_IF of one foot: up from the torso to the pelvis, down the leg.
inline Eigen::Isometry3d foot_in_imu(const Robot& robot, const JointSample& s, std::size_t side) {
  const std::string prefix = side == 0 ? "left" : "right";
  Eigen::Isometry3d T_pelvis_foot = Eigen::Isometry3d::Identity(), T_pelvis_torso = T_pelvis_foot, T_link_imu = T_pelvis_foot;
  for (const BipedJoint& j : biped_joints()) {
    if (j.name == "waist") T_pelvis_torso = transform_of(j, s);
    if (j.name.rfind(prefix, 0) == 0) T_pelvis_foot = T_pelvis_foot * transform_of(j, s);
  }
  T_link_imu.translate(robot.imu.T_link_imu.p);
  T_link_imu.rotate(robot.imu.T_link_imu.R.matrix());
  return (T_pelvis_torso * T_link_imu).inverse() * T_pelvis_foot;
}

}  // namespace kilvo::test
