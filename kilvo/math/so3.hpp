// Rotations: Exp, Log and their Jacobians, right near 0 and near pi. Right perturbation everywhere: R * Exp(theta).
// Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", Eqs. 132-144.
#pragma once

#include <Eigen/Geometry>

namespace kilvo {

/// [v]x, so that skew(v) * w = v x w.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// A rotation matrix that stays one: products are pulled back onto SO(3) to first order.
class SO3 {
 public:
  SO3() : R_(Eigen::Matrix3d::Identity()) {}
  /// The nearest rotation to `m` (`m` within rounding of a rotation matrix).
  static SO3 nearest(const Eigen::Matrix3d& m);
  static SO3 from_quaternion(const Eigen::Quaterniond& q) { return nearest(q.normalized().toRotationMatrix()); }
  /// Rotation vector (rad) to rotation.
  static SO3 Exp(const Eigen::Vector3d& theta);
  /// Rotation vector of length at most pi.
  Eigen::Vector3d Log() const;

  const Eigen::Matrix3d& matrix() const { return R_; }
  Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(R_).normalized(); }
  SO3 inverse() const { return SO3(R_.transpose()); }
  SO3 operator*(const SO3& o) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& v) const { return R_ * v; }

 private:
  explicit SO3(const Eigen::Matrix3d& m) : R_(m) {}
  Eigen::Matrix3d R_;
};

/// Jr(theta): Exp(theta + d) ~ Exp(theta) Exp(Jr d).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& theta);

}  // namespace kilvo
