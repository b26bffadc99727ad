// The joints between two links of a URDF, and how they move the one as the other sees it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/sensors/robot.hpp"

namespace kilvo {

/// A joint and the rigid parts before it, in the frame of the joint before. The frame behind it is turned by R when it is at zero, and a
/// joint that turns by q makes that R + sin(q) sine + (1 - cos(q)) versine (Rodrigues).
struct ChainJoint {
  bool turns = false, slides = false;  // neither: the rigid end of the chain
  JointReading reading;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero(), p = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity(), sine = Eigen::Matrix3d::Zero(), versine = Eigen::Matrix3d::Zero();
};

/// A frame that moves, as the first link of a chain sees it.
struct MovingFrame {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero(), omega = Eigen::Vector3d::Zero();
};

struct JointChain {
  std::vector<ChainJoint> joints;   // the moving ones and the end
  std::vector<std::string> names;   // of the moving ones, in the messages
  std::vector<std::size_t> places;  // in the message, by joint

  /// Finds the joints in a message of these names; the first that is missing, if any.
  std::optional<std::string> look_up(const std::vector<std::string>& message_names);
  /// The last link. Both arrays are those of a message whose names have been looked up.
  MovingFrame end(const std::vector<double>& position, const std::vector<double>& velocity) const;
  /// Where the joints are, and the origin of the last link, m; of a message whose names have been looked up.
  std::vector<Eigen::Vector3d> places_of_joints(const std::vector<double>& position) const;
};

/// The links and joints of a URDF; robot.locked_joints do not move.
class LinkTree {
 public:
  /// Throws std::invalid_argument when the URDF cannot be used.
  explicit LinkTree(const Robot& robot);
  ~LinkTree();
  LinkTree(const LinkTree&) = delete;
  LinkTree& operator=(const LinkTree&) = delete;

  std::string root() const;
  bool has(const std::string& link) const;
  /// Throws std::invalid_argument naming the link that there is not.
  JointChain chain(const std::string& from, const std::string& to) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// "joint NAME is neither in the message nor in robot.locked_joints"
std::string joint_is_missing(const std::string& joint);

}  // namespace kilvo
