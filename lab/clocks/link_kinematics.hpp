// Where any link of the robot is as its IMU sees it, through the joints in between.
#pragma once

#include <optional>
#include <string>

#include "kilvo/legs/joint_chain.hpp"
#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo::lab {

/// Pose and motion of a link relative to the IMU, in the IMU's axes.
struct LinkMotion {
  SE3 T_IL;
  Eigen::Vector3d v = Eigen::Vector3d::Zero();      // m/s
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();  // rad/s
};

class LinkKinematics {
 public:
  /// Throws std::invalid_argument naming the link when the URDF has no such one, or cannot be used.
  LinkKinematics(const Robot& robot, const std::string& link);

  /// No joint that moves is in between: at() needs no message.
  bool is_rigid() const { return chain_.names.empty(); }
  /// A joint in between that the messages must hold; empty when it is rigid.
  std::string first_joint() const { return is_rigid() ? "" : chain_.names.front(); }

  /// Nothing when a joint is not in the message, or not finite. Without velocities in the message those of the link are 0. Allocates only
  /// when the names in the message change.
  std::optional<LinkMotion> at(const JointSample& sample);
  /// Only when is_rigid().
  LinkMotion at_rest() const;

 private:
  LinkMotion relative_to_imu(const MovingFrame& link) const;

  JointChain chain_;
  SE3 T_IM_;  // the link that carries the IMU, in the IMU frame
  JointNames message_names_;
  std::vector<double> zeros_;
  bool known_ = false;  // the joints are in messages of these names
};

}  // namespace kilvo::lab
