#include "kilvo/legs/leg_kinematics.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "kilvo/filter/gap.hpp"
#include "kilvo/legs/joint_chain.hpp"

namespace kilvo {
namespace {

// Corners this much higher than the lowest weigh e times less, m.
constexpr double softness = 0.001;

}  // namespace

struct LegKinematics::Chains {
  bool by_joints = true, forces = false;
  std::array<Foot, 2> feet;
  SE3 T_IL;  // the IMU's link in the IMU frame
  LegsMount mount;
  std::array<JointChain, 2> legs;
  JointNames message_names;  // that the places are for
  // For messages without velocities, or with wrong ones.
  std::vector<double> last_position, velocity;
  Time last_t{};

  std::optional<std::string> look_up_joints(const JointNames& names);
  const std::vector<double>* velocity_of(const JointSample& s);  // nullptr: not known
  FootPose pose_of(std::size_t side, const JointSample& s, const std::vector<double>& velocity);
  std::optional<Eigen::Vector3d> force_on(std::size_t side, const JointSample& s);
  std::vector<double> one_moves;  // all velocities zero but one
};

// Where in a message of these names each joint is.
std::optional<std::string> LegKinematics::Chains::look_up_joints(const JointNames& names) {
  if (names == message_names) return std::nullopt;
  for (JointChain& leg : legs) {
    if (const auto missing = leg.look_up(names)) {
      message_names = {};
      return joint_is_missing(*missing);
    }
  }
  message_names = names;
  last_position.clear();
  return std::nullopt;
}

const std::vector<double>* LegKinematics::Chains::velocity_of(const JointSample& s) {
  if (s.velocity.size() == s.position.size() && mount.velocities == "messages") return &s.velocity;
  const double dt = to_seconds(s.t - last_t);
  constexpr double smoothing = 0.001;  // s, of the low pass over the differences
  velocity.resize(s.position.size());
  // Messages without a stamp that are received at once are closer than any encoder sends: their difference is no velocity.
  const bool known = last_position.size() == s.position.size() && dt > 0.1 * smoothing && dt < blind_gap;
  if (known) {
    const double share = dt / (dt + smoothing);
    for (std::size_t i = 0; i < velocity.size(); ++i) {
      const double difference = std::remainder(s.position[i] - last_position[i], 2 * std::numbers::pi) / dt;  // it may turn on and on
      // After a gap or a joint that was not finite the low pass restarts.
      velocity[i] = std::isfinite(velocity[i]) ? velocity[i] + share * (difference - velocity[i]) : difference;
    }
  } else {
    std::ranges::fill(velocity, std::numeric_limits<double>::quiet_NaN());
  }
  last_position = s.position;
  last_t = s.t;
  return known ? &velocity : nullptr;
}

FootPose LegKinematics::Chains::pose_of(std::size_t side, const JointSample& s, const std::vector<double>& velocity_of_all) {
  FootPose out;
  if (!by_joints) {
    const auto triple = [side](const std::vector<double>& all) { return Eigen::Vector3d(&all[3 * side]); };
    out.corners = 1;
    const Eigen::Vector3d down(0, 0, -mount.sole_offset);
    out.p[0] = mount.T_imu_feet * (triple(s.position) + down);
    out.v[0] = mount.T_imu_feet.R * triple(velocity_of_all);
    return out;
  }
  const MovingFrame foot = legs[side].end(s.position, velocity_of_all);
  const SE3 T_LF{SO3::nearest(foot.R), foot.p};
  out.R_IF = T_IL.R * T_LF.R;
  out.corners = static_cast<int>(feet[side].sole.size());
  for (std::size_t i = 0; i < feet[side].sole.size(); ++i) {
    const Eigen::Vector3d arm = T_LF.R * feet[side].sole[i];
    out.p[i] = T_IL * (T_LF.p + arm);
    out.v[i] = T_IL.R * (foot.v + foot.omega.cross(arm));
  }
  return out;
}

// The force in the middle of the sole that the efforts balance while nothing accelerates: effort = -J' F, J by moving one joint at a time.
std::optional<Eigen::Vector3d> LegKinematics::Chains::force_on(std::size_t side, const JointSample& s) {
  if (!by_joints || s.effort.size() != s.position.size()) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : feet[side].sole) middle += p / static_cast<double>(feet[side].sole.size());
  Eigen::Matrix3d JJ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d Jt = Eigen::Vector3d::Zero();
  one_moves.assign(s.position.size(), 0.0);
  const auto& others = legs[1 - side].places;
  for (const std::size_t place : legs[side].places) {
    if (std::ranges::find(others, place) != others.end()) continue;  // the waist carries both
    one_moves[place] = 1;
    const MovingFrame foot = legs[side].end(s.position, one_moves);
    one_moves[place] = 0;
    const Eigen::Vector3d column = foot.v + foot.omega.cross(foot.R * middle);
    JJ += column * column.transpose();
    Jt += column * s.effort[place];
  }
  JJ.diagonal().array() += 1e-6;  // a straight leg carries along itself without effort, m^2
  const Eigen::Vector3d force = -JJ.ldlt().solve(Jt);
  return force.allFinite() ? std::optional<Eigen::Vector3d>(T_IL.R * force) : std::nullopt;
}

LegKinematics::LegKinematics(const Robot& robot, bool forces, const LinkTree* tree) : chains_(std::make_unique<Chains>()) {
  Chains& c = *chains_;
  c.forces = forces;
  c.mount = robot.legs;
  c.by_joints = robot.legs.type != "feet";
  c.feet = robot.feet;
  c.T_IL = robot.imu.T_link_imu.inverse();
  if (!c.by_joints) return;
  if (robot.urdf.empty()) throw std::invalid_argument("robot.urdf is needed to use the legs");
  const auto own = tree == nullptr ? std::make_unique<LinkTree>(robot) : nullptr;
  for (std::size_t side = 0; side < 2; ++side) {
    const Foot& foot = robot.feet[side];
    if (foot.sole.empty() || foot.sole.size() > max_corners)
      throw std::invalid_argument("robot.feet: the sole of " + foot.name + " needs 1 to " + std::to_string(max_corners) + " points");
    c.legs[side] = (tree == nullptr ? *own : *tree).chain(robot.imu.link, foot.link);
    if (c.legs[side].names.empty()) throw std::invalid_argument("robot.feet: no joint of the URDF moves link " + foot.link);
  }
}

LegKinematics::LegKinematics(LegKinematics&&) noexcept = default;
LegKinematics::~LegKinematics() = default;

std::variant<Feet, std::string> LegKinematics::feet(const JointSample& s) {
  Chains& c = *chains_;
  if (c.by_joints) {
    if (s.names.size() != s.position.size()) return "as many names as positions are needed";
    if (auto missing = c.look_up_joints(s.names)) return std::move(*missing);
  } else if (s.position.size() != 6) {
    return "two feet need six positions";
  }
  const std::vector<double>* velocity = c.velocity_of(s);
  if (velocity == nullptr) return "without velocities a message needs one shortly before it";
  Feet out;
  out.t = s.t;
  for (std::size_t side = 0; side < 2; ++side) {
    out.foot[side] = c.pose_of(side, s, *velocity);
    for (int i = 0; i < out.foot[side].corners; ++i) {
      if (!out.foot[side].p[static_cast<std::size_t>(i)].allFinite() || !out.foot[side].v[static_cast<std::size_t>(i)].allFinite())
        return "not finite";
    }
  }
  if (!c.forces) return out;
  const auto left = c.force_on(0, s), right = c.force_on(1, s);
  if (left && right) out.force_I = {*left, *right};
  return out;
}

std::optional<std::string> LegKinematics::mismatch(const JointSample& s) const {
  const Chains& c = *chains_;
  if (!c.by_joints) {
    if (s.position.size() == 6) return std::nullopt;
    return "legs.type: feet needs messages of six positions, two feet; these have " + std::to_string(s.position.size());
  }
  for (const JointChain& leg : c.legs) {
    for (const std::string& joint : leg.names) {
      if (std::ranges::find(s.names, joint) == s.names.end()) return joint_is_missing(joint);
    }
  }
  return std::nullopt;
}

SolePoint lowest_point(const FootPose& foot, const Eigen::Vector3d& up_I) {
  double lowest = up_I.dot(foot.p[0]);
  for (int i = 1; i < foot.corners; ++i) lowest = std::min(lowest, up_I.dot(foot.p[static_cast<std::size_t>(i)]));
  SolePoint out;
  double sum = 0;
  for (int i = 0; i < foot.corners; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double w = std::exp((lowest - up_I.dot(foot.p[k])) / softness);
    sum += w;
    out.p += w * foot.p[k];
    out.v += w * foot.v[k];
  }
  out.p /= sum;
  out.v /= sum;
  return out;
}

}  // namespace kilvo
