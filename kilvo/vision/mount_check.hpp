// Whether the camera is mounted as configured. If it is turned by psi (IMU frame), a view from R_r puts the points of a map so that, seen
// from R_c, the camera seems to be turned by (R_c' R_r - I) psi against where the LiDAR has it: nothing while the robot looks the same way,
// the more the more it turns. So psi is a least-squares problem over all images, and small turns suffice.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "kilvo/math/so3.hpp"

namespace kilvo {

class MountCheck {
 public:
  /// An image from R_WI = R_c, held against views from R_r, says that the body is turned by d: information A on d (3x3, rad^-2), and b = A
  /// d.
  void add(const SO3& R_c, const SO3& R_r, const Eigen::Matrix3d& A, const Eigen::Vector3d& b);

  /// The turn of the camera in the IMU frame, rad, if the images so far are sure that there is one worth speaking of.
  std::optional<Eigen::Vector3d> misalignment() const;

 private:
  Eigen::Matrix3d N_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d n_ = Eigen::Vector3d::Zero();
  int views_ = 0;
};

}  // namespace kilvo
