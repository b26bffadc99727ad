// What a robot that is not quite as described does to the motion that its legs and gyro measure: the mount of the IMU on the legs' link,
// the lengths of the legs, soles that roll on with every step, the scale of the gyro. Such an error is the same at every step, so that no
// noise term models it: it grows with the distance, and the way back cancels a part.
//
// Where the body moves with v the legs measure (I + M) v. M is learnt while something else measures the pose. While nothing does, what is
// not known of M, the scale of the gyro and the drift of its bias (it warms up) are parameters that are considered, not estimated (Schmidt
// 1966): their effect on the pose is accumulated along the path.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "kilvo/filter/state.hpp"

namespace kilvo {

class LegMotionError {
 public:
  LegMotionError();

  /// M, in the IMU frame, as far as it is significant. Its vertical part is never learnt: how soles sink and roll depends on the ground.
  const Eigen::Matrix3d& matrix() const { return corrected_; }

  /// Something else has measured the pose, but for the position along `unknown` (takes an error of the position to its part there).
  void pose_is_measured(const Eigen::Matrix3d& unknown);
  /// The next state. `velocity_I`: of the IMU by the stance feet, m/s; `weight`: of that, 0 for none; `alone`: by nothing else.
  void add(const State& x, const Eigen::Vector3d& velocity_I, double weight, double dt, bool alone);
  /// To be added to the covariance of `x`, a state at or after the last one that was added.
  PoseCovariance error(const State& x) const;

 private:
  using Effect = Eigen::Matrix<double, 3, 9>;  // on the position, of the columns of M one after the other, m
  void learn(const Eigen::Vector3d& up_W);

  Eigen::Matrix3d M_ = Eigen::Matrix3d::Zero(), corrected_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 9, 9> P_;
  // Of what is not known since the pose was measured.
  std::optional<SE3> last_;
  Effect by_legs_ = Effect::Zero();
  Eigen::Vector3d by_gyro_ = Eigen::Vector3d::Zero();   // m per unit
  double turned_ = 0;                                   // about the vertical, rad
  Eigen::Vector3d by_drift_ = Eigen::Vector3d::Zero();  // m per rad/s^2
  double alone_for_ = 0;                                // since something else measured the heading, s
  bool is_known_ = false, measured_ = false;            // all of the pose; since the last state
  // Since a comparison began: sums over time of what the legs measure too much, world frame.
  struct Comparison {
    Eigen::Vector3d off = Eigen::Vector3d::Zero();  // m
    Effect effect = Effect::Zero();
    double time = 0, weight = 0;  // s
  };
  std::optional<Comparison> comparison_;
};

}  // namespace kilvo
