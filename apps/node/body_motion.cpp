#include "apps/node/body_motion.hpp"

namespace kilvo::node {
namespace {

constexpr int position = 0, rotation = 3;  // in a pose of ROS
constexpr int linear = 0, angular = 3;     // in a twist of ROS

using Jacobian = Eigen::Matrix<double, 6, at::size>;

// Exact symmetry, which products of matrices lose in the last bit.
Matrix6 propagate(const Jacobian& J, const Covariance& P) {
  const Matrix6 C = J * P * J.transpose();
  return 0.5 * (C + C.transpose());
}

// The state's rotation error is on the right (R Exp(d), axes of the IMU); about fixed axes the same turn is R d.
Matrix6 pose_covariance(const Output& o, const Eigen::Vector3d& t_I) {
  const Eigen::Matrix3d& R = o.x.R.matrix();
  Jacobian J = Jacobian::Zero();
  J.block<3, 3>(position, at::p).setIdentity();
  J.block<3, 3>(position, at::R) = -R * skew(t_I);
  J.block<3, 3>(rotation, at::R) = R;
  return propagate(J, o.P);
}

// v_I = R' v, so that its error is R' dv + [v_I]x d; omega is what the gyro says without its bias.
Matrix6 twist_covariance(const Output& o, const Eigen::Vector3d& v_I, const SE3& T_IB, double rate_variance) {
  const Eigen::Matrix3d to_base = T_IB.R.matrix().transpose();
  Jacobian J = Jacobian::Zero();
  J.block<3, 3>(linear, at::v) = to_base * o.x.R.matrix().transpose();
  J.block<3, 3>(linear, at::R) = to_base * skew(v_I);
  J.block<3, 3>(linear, at::bg) = to_base * skew(T_IB.p);
  J.block<3, 3>(angular, at::bg) = -to_base;
  Eigen::Matrix<double, 6, 3> of_rate;  // omega x t = -[t]x omega
  of_rate << -to_base * skew(T_IB.p), to_base;
  const Matrix6 noise = rate_variance * (of_rate * of_rate.transpose());
  return propagate(J, o.P) + 0.5 * (noise + noise.transpose());
}

}  // namespace

bool BodyMotion::is_finite() const {
  return pose.p.allFinite() && pose.R.matrix().allFinite() && v_B.allFinite() && omega_B.allFinite() && pose_covariance.allFinite() &&
         twist_covariance.allFinite();
}

BodyMotion body_motion(const Output& output, const lab::LinkMotion& base, double rate_variance) {
  const SE3& T_IB = base.T_IL;
  const Eigen::Vector3d v_I = output.x.R.inverse() * output.x.v;
  const SO3 R_BI = T_IB.R.inverse();
  return {output.x.pose() * T_IB, R_BI * (v_I + output.omega.cross(T_IB.p) + base.v), R_BI * (output.omega + base.omega),
          pose_covariance(output, T_IB.p), twist_covariance(output, v_I, T_IB, rate_variance)};
}

BodyMotion seen_from(const BodyMotion& motion, const Output& output, const SE3& T_OI, const SE3& T_IB) {
  const Eigen::Matrix3d R_OW = T_OI.R.matrix() * output.x.R.matrix().transpose();
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = R_OW;
  turn.bottomRightCorner<3, 3>() = R_OW;
  BodyMotion out = motion;
  out.pose = T_OI * T_IB;
  const Matrix6 C = turn * motion.pose_covariance * turn.transpose();
  out.pose_covariance = 0.5 * (C + C.transpose());
  return out;
}

}  // namespace kilvo::node
