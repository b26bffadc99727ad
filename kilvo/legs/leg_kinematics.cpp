#include "kilvo/legs/leg_kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <console_bridge/console.h>
#include <kdl/tree.hpp>
#include <limits>
#include <optional>
#include <stdexcept>
#include <urdf_parser/urdf_parser.h>

namespace kilvo {
namespace {

// Corners this much higher than the lowest weigh e times less, m.
constexpr double softness = 0.001;

KDL::Vector to_kdl(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }
KDL::Frame to_kdl(const urdf::Pose& p) {
  return {KDL::Rotation::Quaternion(p.rotation.x, p.rotation.y, p.rotation.z, p.rotation.w), to_kdl(p.position)};
}
Eigen::Vector3d to_eigen(const KDL::Vector& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Matrix3d to_eigen(const KDL::Rotation& R) { return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data); }

KDL::Joint to_kdl(const urdf::Joint& joint, bool locked) {
  const auto fault = [&joint](const char* what) { return std::invalid_argument("robot.urdf: joint " + joint.name + what); };
  const KDL::Frame origin = to_kdl(joint.parent_to_joint_origin_transform);
  const KDL::Vector axis = origin.M * to_kdl(joint.axis);
  constexpr double absurd_length = 100;  // m
  if (!(origin.p.Norm() < absurd_length)) throw fault(": origin is over 100 m away");
  if (locked || joint.type == urdf::Joint::FIXED) return KDL::Joint(joint.name, KDL::Joint::Fixed);
  if (!(axis.Norm() > 1e-6)) throw fault(": axis has no length");
  if (joint.type == urdf::Joint::PRISMATIC) return {joint.name, origin.p, axis, KDL::Joint::TransAxis};
  if (joint.type != urdf::Joint::REVOLUTE && joint.type != urdf::Joint::CONTINUOUS)
    throw fault(" is neither revolute, prismatic nor fixed");
  return {joint.name, origin.p, axis, KDL::Joint::RotAxis};
}

void add_children(const urdf::Link& link, const Robot& robot, KDL::Tree& tree) {
  for (const auto& child : link.child_links) {
    const urdf::Joint& joint = *child->parent_joint;
    const bool locked = std::ranges::find(robot.locked_joints, joint.name) != robot.locked_joints.end();
    const KDL::Segment segment(child->name, to_kdl(joint, locked), to_kdl(joint.parent_to_joint_origin_transform));
    if (!tree.addSegment(segment, link.name)) throw std::invalid_argument("robot.urdf: link " + child->name + " cannot be attached");
    add_children(*child, robot, tree);
  }
}

// Keeps what the parser has to say, instead of letting it print, as long as this lives.
class UrdfLog final : public console_bridge::OutputHandler {
 public:
  UrdfLog() { console_bridge::useOutputHandler(this); }
  ~UrdfLog() override { console_bridge::restorePreviousOutputHandler(); }
  UrdfLog(const UrdfLog&) = delete;
  UrdfLog& operator=(const UrdfLog&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (first_.empty() && level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) first_ = ": " + text;
  }
  const std::string& first() const { return first_; }

 private:
  std::string first_;
};

KDL::Tree tree_of(const Robot& robot) {
  const UrdfLog words;
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(robot.urdf);
  if (!model || !model->getRoot()) throw std::invalid_argument("robot.urdf is not a URDF document" + words.first());
  KDL::Tree tree(model->getRoot()->name);
  add_children(*model->getRoot(), robot, tree);
  return tree;
}

std::string missing(const std::string& joint) { return "joint " + joint + " is neither in the message nor in robot.locked_joints"; }

// A joint and the rigid parts before it, in the frame of the joint before; R: how the frame behind it is turned when it is at zero.
struct Joint {
  bool turns = false, slides = false;  // neither: the rigid end of the leg
  Eigen::Vector3d axis = Eigen::Vector3d::Zero(), p = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
};

// One leg: its joints from the IMU to the foot, and where in the message each of them is.
struct Leg {
  std::vector<Joint> joints;        // the moving ones and the end
  std::vector<std::string> names;   // of the moving ones
  std::vector<std::size_t> places;  // in the message, by joint
};

Leg leg_of(const KDL::Tree& tree, const std::string& imu_link, const Foot& foot) {
  Leg leg;
  for (const std::string& link : {imu_link, foot.link}) {
    if (tree.getSegment(link) == tree.getSegments().end()) throw std::invalid_argument("robot.urdf has no link " + link);
  }
  KDL::Chain chain;
  if (!tree.getChain(imu_link, foot.link, chain))
    throw std::invalid_argument("robot.urdf: no way from link " + imu_link + " to link " + foot.link);
  Joint next;
  for (const KDL::Segment& s : chain.segments) {
    const KDL::Frame at_zero = s.pose(0);
    const KDL::Joint& joint = s.getJoint();
    next.turns = joint.getType() == KDL::Joint::RotAxis;
    next.slides = joint.getType() == KDL::Joint::TransAxis;
    const bool moves = next.turns || next.slides;
    // Against the tree's direction a joint is not where its segment ends: the rest of the way belongs to the next joint.
    const Eigen::Vector3d end = to_eigen(at_zero.p), origin = moves ? to_eigen(joint.JointOrigin()) : end;
    const Eigen::Matrix3d turned = to_eigen(at_zero.M);
    next.p += next.R * origin;
    next.axis = next.R * to_eigen(joint.JointAxis());
    next.R = (next.R * turned).eval();
    if (!moves) continue;
    leg.names.push_back(joint.getName());
    leg.joints.push_back(next);
    next = Joint{};
    next.p = turned.transpose() * (end - origin);
  }
  leg.joints.push_back(next);
  return leg;
}

// A frame that moves, as its base sees it.
struct Moving {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero(), omega = Eigen::Vector3d::Zero();
};

// From the frame behind one joint to that behind the next.
void pass(const Joint& joint, double q, double dq, Moving& frame) {
  const Eigen::Vector3d arm = frame.R * joint.p;
  frame.p += arm;
  frame.v += frame.omega.cross(arm);
  const Eigen::Vector3d axis = frame.R * joint.axis;
  if (joint.slides) {
    frame.p += q * axis;
    frame.v += frame.omega.cross(q * axis) + dq * axis;
  }
  if (joint.turns) frame.omega += dq * axis;
  frame.R = (frame.R * (joint.turns ? Eigen::Matrix3d(SO3::Exp(q * joint.axis).matrix() * joint.R) : joint.R)).eval();
}

}  // namespace

struct LegKinematics::Chains {
  bool by_joints = true;
  std::array<Foot, 2> feet;
  SE3 T_IL;  // the IMU's link in the IMU frame
  LegsMount mount;
  std::array<Leg, 2> legs;
  std::vector<std::string> message_names;  // that the places are for
  // For messages without velocities.
  std::vector<double> last_position, velocity;
  Time last_t{};

  std::optional<std::string> look_up_planes(const std::vector<std::string>& names);
  const std::vector<double>* velocity_of(const JointSample& s);  // nullptr: not known
  FootPose pose_of(std::size_t side, const JointSample& s, const std::vector<double>& velocity);
};

// Where in a message of these names each joint is.
std::optional<std::string> LegKinematics::Chains::look_up_planes(const std::vector<std::string>& names) {
  if (names == message_names) return std::nullopt;
  for (Leg& leg : legs) {
    leg.places.clear();
    for (const std::string& joint : leg.names) {
      const auto it = std::ranges::find(names, joint);
      if (it == names.end()) {
        message_names.clear();
        return missing(joint);
      }
      leg.places.push_back(static_cast<std::size_t>(it - names.begin()));
    }
  }
  message_names = names;
  last_position.clear();
  return std::nullopt;
}

const std::vector<double>* LegKinematics::Chains::velocity_of(const JointSample& s) {
  if (s.velocity.size() == s.position.size()) return &s.velocity;
  const double dt = to_seconds(s.t - last_t);
  constexpr double longest = 0.1;      // s
  constexpr double smoothing = 0.001;  // s, of the low pass over the differences
  velocity.resize(s.position.size());
  const bool known = last_position.size() == s.position.size() && dt > 0 && dt < longest;
  if (known) {
    const double share = dt / (dt + smoothing);
    for (std::size_t i = 0; i < velocity.size(); ++i) {
      const double difference = (s.position[i] - last_position[i]) / dt;
      // After a gap or a joint that was not finite the low pass begins anew.
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
    const auto triple = [side](const std::vector<double>& all) {
      return Eigen::Vector3d(all[3 * side], all[3 * side + 1], all[3 * side + 2]);
    };
    out.corners = 1;
    const Eigen::Vector3d down(0, 0, -mount.sole_offset);
    out.p[0] = mount.T_imu_feet * (triple(s.position) + down);
    out.v[0] = mount.T_imu_feet.R * triple(velocity_of_all);
    return out;
  }
  const Leg& leg = legs[side];
  Moving foot;
  for (std::size_t i = 0; i < leg.places.size(); ++i) pass(leg.joints[i], s.position[leg.places[i]], velocity_of_all[leg.places[i]], foot);
  pass(leg.joints.back(), 0, 0, foot);
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

LegKinematics::LegKinematics(const Robot& robot) : chains_(std::make_unique<Chains>()) {
  Chains& c = *chains_;
  c.mount = robot.legs;
  c.by_joints = robot.legs.type != "feet";
  c.feet = robot.feet;
  c.T_IL = robot.imu.T_link_imu.inverse();
  if (!c.by_joints) return;
  if (robot.urdf.empty()) throw std::invalid_argument("robot.urdf is needed to use the legs");
  const KDL::Tree tree = tree_of(robot);
  for (std::size_t side = 0; side < 2; ++side) {
    const Foot& foot = robot.feet[side];
    if (foot.sole.empty() || foot.sole.size() > max_corners)
      throw std::invalid_argument("robot.feet: the sole of " + foot.name + " needs 1 to " + std::to_string(max_corners) + " points");
    c.legs[side] = leg_of(tree, robot.imu.link, foot);
  }
}

LegKinematics::LegKinematics(LegKinematics&&) noexcept = default;
LegKinematics::~LegKinematics() = default;

std::variant<Feet, std::string> LegKinematics::feet(const JointSample& s) {
  Chains& c = *chains_;
  if (c.by_joints) {
    if (s.names.size() != s.position.size()) return "as many names as positions are needed";
    if (auto missing = c.look_up_planes(s.names)) return std::move(*missing);
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
  return out;
}

std::optional<std::string> LegKinematics::mismatch(const JointSample& s) const {
  const Chains& c = *chains_;
  if (!c.by_joints) {
    if (s.position.size() == 6) return std::nullopt;
    return "legs.type: feet needs messages of six positions, two feet; these have " + std::to_string(s.position.size());
  }
  for (const Leg& leg : c.legs) {
    for (const std::string& joint : leg.names) {
      if (std::ranges::find(s.names, joint) == s.names.end()) return missing(joint);
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
