// How wrong the described mount may be. What a sweep measures is the pose of the LiDAR; the pose of the IMU follows by the mount as it is
// described. Where LiDAR and gyro turn about axes, or by angles, that differ, one of the two descriptions is not exact, and nothing tells
// which: the mount may be wrong by as much. A robot that turns then seems to have moved.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "kilvo/filter/state.hpp"
#include "kilvo/filter/trajectory.hpp"

namespace kilvo {

class MountError {
 public:
  /// The pose that errors are relative to.
  void begin_at(const SE3& T_WI) { first_ = T_WI; }

  /// A sweep turned the state at `t` to R_WI; between sweeps the trajectory has turned by the gyro.
  void add(Time t, const SO3& R_WI, const Trajectory& trajectory);
  /// The sweep before is not one to compare with.
  void restart() { since_.reset(); }

  /// Standard deviation of each component of the mount's rotation, rad: what is expected after what was seen. Zero before.
  double sigma() const { return sigma_; }
  /// Covariance of the error of a pose (rotation, position; state.hpp) relative to the first one that comes from the mount.
  PoseCovariance at(const SE3& T_WI) const;

 private:
  using Regressors = Eigen::Vector4d;  // turn by the gyro, rad, and time, s
  void learn();

  SE3 first_;
  struct Window {
    Time t{};
    SO3 R_WI;
  };
  std::optional<Window> since_;
  // Least squares of D = M x, D: turn by the sweeps less turn by the gyro, x: the regressors; M is 3x3 and a rest of the gyro's bias.
  Eigen::Matrix4d xx_ = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 3, 4> Dx_ = Eigen::Matrix<double, 3, 4>::Zero();
  double DD_ = 0, weight_ = 0;
  double noise_ = 0;  // variance of a component of D, rad^2; 0: not known
  double sigma_ = 0;
};

}  // namespace kilvo
