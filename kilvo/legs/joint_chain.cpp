#include "kilvo/legs/joint_chain.hpp"

#include <algorithm>
#include <cmath>
#include <console_bridge/console.h>
#include <kdl/tree.hpp>
#include <stdexcept>
#include <urdf_parser/urdf_parser.h>

#include "kilvo/math/so3.hpp"

namespace kilvo {
namespace {

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
  if (joint.type != urdf::Joint::PRISMATIC && joint.type != urdf::Joint::REVOLUTE && joint.type != urdf::Joint::CONTINUOUS)
    throw fault(" is neither revolute, prismatic nor fixed");
  if (!(axis.Norm() > 1e-6)) throw fault(": axis has no length");
  return {joint.name, origin.p, axis, joint.type == urdf::Joint::PRISMATIC ? KDL::Joint::TransAxis : KDL::Joint::RotAxis};
}

void add_children(const urdf::Link& link, const Robot& robot, KDL::Tree& tree) {
  for (const auto& child : link.child_links) {
    const urdf::Joint& joint = *child->parent_joint;
    const bool locked = std::ranges::find(robot.locked_joints, joint.name) != robot.locked_joints.end();
    const KDL::Segment segment(child->name, to_kdl(joint, locked), to_kdl(joint.parent_to_joint_origin_transform));
    if (!tree.addSegment(segment, link.name)) throw std::invalid_argument("robot.urdf: two joints lead to link " + child->name);
    add_children(*child, robot, tree);
  }
}

// Keeps the parser's messages, instead of letting it print, as long as this lives.
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
  urdf::LinkConstSharedPtr root = model->getRoot();  // of the robot, not of a world in which it floats
  const auto is_world = [&](const urdf::Link& link) { return link.name != robot.imu.link && link.child_links.size() == 1; };
  while (is_world(*root) && root->child_joints[0]->type == urdf::Joint::FLOATING) root = root->child_links[0];
  KDL::Tree tree(root->name);
  add_children(*root, robot, tree);
  return tree;
}

// From the frame behind one joint to that behind the next, by the values of a message.
void pass(const ChainJoint& joint, double value, double rate, MovingFrame& frame) {
  const double q = joint.reading.sign * value + joint.reading.zero, dq = joint.reading.sign * rate;
  const Eigen::Vector3d arm = frame.R * joint.p;
  frame.p += arm;
  frame.v += frame.omega.cross(arm);
  const Eigen::Vector3d axis = frame.R * joint.axis;
  if (joint.slides) {
    frame.p += q * axis;
    frame.v += frame.omega.cross(q * axis) + dq * axis;
  }
  if (joint.turns) frame.omega += dq * axis;
  frame.R = (frame.R * (joint.turns ? joint.R + std::sin(q) * joint.sine + (1 - std::cos(q)) * joint.versine : joint.R)).eval();
}

}  // namespace

struct LinkTree::Tree {
  KDL::Tree tree;
  std::map<std::string, JointReading> readings;
};

LinkTree::LinkTree(const Robot& robot) : tree_(std::make_unique<Tree>(Tree{tree_of(robot), robot.joints})) {}
LinkTree::~LinkTree() = default;

std::string LinkTree::root() const { return tree_->tree.getRootSegment()->first; }

bool LinkTree::has(const std::string& link) const { return tree_->tree.getSegment(link) != tree_->tree.getSegments().end(); }

JointChain LinkTree::chain(const std::string& from, const std::string& to) const {
  for (const std::string& link : {from, to}) {
    if (!has(link)) throw std::invalid_argument("robot.urdf has no link " + link);
  }
  JointChain out;
  KDL::Chain chain;
  if (!tree_->tree.getChain(from, to, chain)) throw std::invalid_argument("robot.urdf: no way from link " + from + " to link " + to);
  ChainJoint next;
  for (const KDL::Segment& s : chain.segments) {
    const KDL::Frame at_zero = s.pose(0);
    const KDL::Joint& joint = s.getJoint();
    next.turns = joint.getType() == KDL::Joint::RotAxis;
    next.slides = joint.getType() == KDL::Joint::TransAxis;
    const bool moves = next.turns || next.slides;
    // Against the tree's direction a joint is not where its segment ends: the rest belongs to the next joint.
    const Eigen::Vector3d end = to_eigen(at_zero.p), origin = moves ? to_eigen(joint.JointOrigin()) : end;
    const Eigen::Matrix3d turned = to_eigen(at_zero.M);
    next.p += next.R * origin;
    next.axis = next.R * to_eigen(joint.JointAxis());
    next.R = (next.R * turned).eval();
    next.sine = skew(next.axis) * next.R;
    next.versine = skew(next.axis) * next.sine;
    if (!moves) continue;
    if (const auto it = tree_->readings.find(joint.getName()); it != tree_->readings.end()) next.reading = it->second;
    out.names.push_back(next.reading.from.empty() ? joint.getName() : next.reading.from);
    out.joints.push_back(next);
    next = ChainJoint{};
    next.p = turned.transpose() * (end - origin);
  }
  out.joints.push_back(next);
  return out;
}

std::optional<std::string> JointChain::look_up(const std::vector<std::string>& message_names) {
  places.clear();
  for (const std::string& joint : names) {
    const auto it = std::ranges::find(message_names, joint);
    if (it == message_names.end()) return joint;
    places.push_back(static_cast<std::size_t>(it - message_names.begin()));
  }
  return std::nullopt;
}

std::vector<Eigen::Vector3d> JointChain::places_of_joints(const std::vector<double>& position) const {
  std::vector<Eigen::Vector3d> out;
  MovingFrame frame;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    pass(joints[i], i < places.size() ? position[places[i]] : 0, 0, frame);
    out.push_back(frame.p);
  }
  return out;
}

MovingFrame JointChain::end(const std::vector<double>& position, const std::vector<double>& velocity) const {
  MovingFrame frame;
  for (std::size_t i = 0; i < places.size(); ++i) pass(joints[i], position[places[i]], velocity[places[i]], frame);
  pass(joints.back(), 0, 0, frame);
  return frame;
}

std::string joint_is_missing(const std::string& joint) {
  return "joint " + joint + " is neither in the message nor in robot.locked_joints";
}

}  // namespace kilvo
