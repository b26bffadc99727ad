// Whether the camera is mounted as configured. If it is turned by -psi (IMU frame) against that, a view from R_r puts the points of a map
// so that, seen from R_c, the camera seems to be turned by (R_c' R_r - I) psi against where the LiDAR has it: nothing while the robot keeps
// its orientation, the more the more it turns. If its stamps are tau too small, it seems to be turned by (omega_c - R_c' R_r omega_r) tau
// besides. So psi and tau are a least-squares problem over all images, and small turns suffice.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "kilvo/math/so3.hpp"

namespace kilvo {

/// The rotation of the body measured by one frame's patches, before any was rejected for its position.
struct ImageTurn {
  std::uint32_t frame = 0;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();  // A * turn
};

/// The mount is that of the description but for about this, rad.
inline constexpr double likely_mount = 0.02;

class MountCheck {
 public:
  struct View {
    SO3 R_WI;
    Eigen::Vector3d omega;  // of the body, in its frame, rad/s
  };
  /// An image, compared with earlier views, measures a rotation of the body by d: information A on d (3x3, rad^-2), and b = A d. False
  /// where a wrong mount or clock would turn both alike.
  bool add(const View& image, const View& earlier, const Eigen::Matrix3d& A, const Eigen::Vector3d& b);

  /// psi, the turn of the description against the camera in the IMU frame, rad, if the images so far are sure of one worth speaking of.
  std::optional<Eigen::Vector3d> misalignment() const;

  /// s, to be added to the stamps of the images, if they are sure that these are off by more than `least`.
  std::optional<double> time_offset(double least) const;

  /// So much of both is corrected: the images so far speak of what is left.
  void correct(const Eigen::Vector3d& misalignment, double time_offset) {
    n_ -= N_ * (Eigen::Vector4d() << misalignment, time_offset).finished();
  }

 private:
  Eigen::Matrix4d N_ = Eigen::Matrix4d::Zero();  // of (psi, tau)
  Eigen::Vector4d n_ = Eigen::Vector4d::Zero();
  int views_ = 0;
};

}  // namespace kilvo
