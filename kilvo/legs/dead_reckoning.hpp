// How far the pose may be off because a robot is never quite what its description says, while only its legs and gyro measure its motion:
// the mount of the IMU on the legs' link, the lengths of the legs, the scale of the gyro. Such an error is the same at every step, so that
// no noise term models it: it grows with the way, and a way back undoes it in part. The three are parameters that are considered, not
// estimated (Schmidt 1966): their effect on the pose is summed up along the way.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "kilvo/filter/state.hpp"

namespace kilvo {

class DeadReckoning {
 public:
  /// The pose is known by something else.
  void restart() { *this = {}; }
  /// The next state of a way on the legs alone.
  void add(const State& x);
  /// To be added to the covariance of `x`, a state at or after the last one that was added.
  PoseCovariance error(const State& x) const;

 private:
  std::optional<SE3> last_;
  Eigen::Matrix3d by_mount_ = Eigen::Matrix3d::Zero();                                       // m per rad
  Eigen::Vector3d by_length_ = Eigen::Vector3d::Zero(), by_gyro_ = Eigen::Vector3d::Zero();  // m per unit
  double turned_ = 0;                                                                        // about the vertical, rad
};

}  // namespace kilvo
