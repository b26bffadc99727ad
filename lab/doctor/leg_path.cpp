#include "lab/doctor/leg_path.hpp"

#include <stdexcept>

namespace kilvo::lab {

const LinkTree& RecordedLegs::tree(const Robot& robot) {
  return trees_.try_emplace({robot.urdf, robot.locked_joints, robot.joints}, robot).first->second;
}

// For poses alone.
LegKinematics RecordedLegs::kinematics(const Robot& robot) {
  Robot still = robot;
  still.legs.velocities = "messages";
  return robot.urdf.empty() ? LegKinematics(still) : LegKinematics(still, false, &tree(robot));
}

std::map<std::string, std::string> RecordedLegs::names_of_joints(const Robot& robot) {
  Robot as_urdf = robot;
  as_urdf.joints.clear();
  std::map<std::string, std::string> out;
  for (const Foot& foot : robot.feet) {
    const JointChain joints = tree(as_urdf).chain(robot.imu.link, foot.link), read = tree(robot).chain(robot.imu.link, foot.link);
    for (std::size_t i = 0; i < joints.names.size(); ++i) out.emplace(joints.names[i], read.names[i]);
  }
  return out;
}

LegSides RecordedLegs::sides(const Robot& robot) {
  try {
    return robot.urdf.empty() ? LegSides() : LegSides(tree(robot), robot);
  } catch (const std::invalid_argument&) {
    return {};
  }
}

std::vector<LegPose> RecordedLegs::path(const Robot& robot, const LegHypothesis* hypothesis, double period, std::string* why) {
  std::vector<LegPose> out;
  Robot of_link = robot;
  of_link.imu.T_link_imu = SE3{};  // the IMU's mount is what shall be judged
  if (hypothesis != nullptr && hypothesis->robot) hypothesis->robot(of_link);
  JointSample sample;
  JointNames::List names = recorded_.joint_names;
  if (hypothesis != nullptr && hypothesis->names) hypothesis->names(names);
  sample.names = std::move(names);
  try {
    LegKinematics legs = kinematics(of_link);
    double last = -1e9;
    for (const LegSample& leg : recorded_.legs) {
      if (leg.t - last < period) continue;
      sample.t = time_from_ns(0) + from_seconds(leg.t);
      sample.position = leg.position;
      sample.velocity.assign(leg.position.size(), 0);
      if (hypothesis != nullptr && hypothesis->position) {
        for (std::size_t i = 0; i < sample.position.size(); ++i) hypothesis->position(i, sample.position[i]);
      }
      const auto feet = legs.feet(sample);
      if (const auto* reason = std::get_if<std::string>(&feet)) {
        if (why != nullptr) *why = *reason;
        continue;
      }
      last = leg.t;
      out.push_back({leg.t, std::get<Feet>(feet).foot});
    }
  } catch (const std::invalid_argument& error) {
    if (why != nullptr) *why = error.what();
  }
  return out;
}

std::vector<std::size_t> RecordedLegs::joints_that_matter(const Robot& robot) {
  std::vector<std::size_t> out;
  if (recorded_.legs.empty()) return out;
  JointSample sample;
  sample.names = recorded_.joint_names;
  sample.position = recorded_.legs[recorded_.legs.size() / 2].position;
  sample.velocity.assign(sample.position.size(), 0);
  try {
    LegKinematics legs = kinematics(robot);
    const auto before = legs.feet(sample);
    for (std::size_t i = 0; std::holds_alternative<Feet>(before) && i < sample.position.size(); ++i) {
      JointSample moved = sample;
      moved.position[i] += 0.3;
      const auto after = legs.feet(moved);
      if (!std::holds_alternative<Feet>(after)) continue;
      double change = 0;
      for (std::size_t f = 0; f < 2; ++f)
        change += (std::get<Feet>(after).foot[f].R_IF.matrix() - std::get<Feet>(before).foot[f].R_IF.matrix()).norm();
      if (change > 1e-6) out.push_back(i);
    }
  } catch (const std::invalid_argument&) {
    out.clear();
  }
  return out;
}

std::vector<Turn> leg_turns(const std::vector<LegPose>& path, double interval) {
  std::vector<Turn> out;
  for (std::size_t i = 0, j = 0; i < path.size(); i = j) {
    j = i + 1;
    while (j < path.size() && path[j].t - path[i].t < interval - 1e-4) ++j;
    if (j >= path.size()) break;
    if (path[j].t - path[i].t > 2 * interval) continue;  // a gap
    Turn turn{path[i].t, path[j].t, {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}, 2};
    for (std::size_t f = 0; f < 2; ++f) {
      // The foot stands still: R_W,link = R_WF R_link,F^T.
      turn.theta[f] = (path[i].foot[f].R_IF * path[j].foot[f].R_IF.inverse()).Log();
    }
    out.push_back(turn);
  }
  return out;
}

}  // namespace kilvo::lab
