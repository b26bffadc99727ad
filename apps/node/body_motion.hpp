// Pose and twist of the robot's base with their covariances as nav_msgs/Odometry wants them, from the state of the IMU.
#pragma once

#include <Eigen/Core>

#include "kilvo/estimator/output.hpp"
#include "kilvo/math/se3.hpp"
#include "lab/clocks/link_kinematics.hpp"

namespace kilvo::node {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct BodyMotion {
  SE3 pose;                      // T_WB
  Eigen::Vector3d v_B, omega_B;  // of the base relative to the world, in the base's own axes, m/s, rad/s
  Matrix6 pose_covariance;       // of (x, y, z, rotation about the world's fixed x, y, z)
  Matrix6 twist_covariance;      // of (v_B, omega_B)

  bool is_finite() const;
};

/// `base`: where it is, and how it moves, as the IMU sees it. `rate_variance`: of the white noise of the angular rate, each axis,
/// (rad/s)^2.
BodyMotion body_motion(const Output& output, const lab::LinkMotion& base, double rate_variance);

/// The same seen from another world, in which the IMU's pose is `T_OI`: covariances are turned with it.
BodyMotion seen_from(const BodyMotion& motion, const Output& output, const SE3& T_OI, const SE3& T_IB);

}  // namespace kilvo::node
