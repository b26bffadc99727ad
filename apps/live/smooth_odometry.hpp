// The pose that a controller can differentiate: the best estimate without its steps. What a correction moved is bled in over some time
// instead, so that this pose is late in knowing better but never jumps (REP 105, frame `odom`).
#pragma once

#include <optional>

#include "kilvo/estimator/output.hpp"
#include "kilvo/math/se3.hpp"

namespace kilvo {

class SmoothOdometry {
 public:
  /// `time`: s, after which about two thirds of a correction are in.
  explicit SmoothOdometry(double time) : time_(time) {}

  /// The smooth pose of the IMU at output.t. Outputs come in time order.
  SE3 add(const Output& output);

 private:
  double time_;
  std::optional<Time> t_;
  SE3 pose_;                                         // T_OI
  Eigen::Vector3d v_ = Eigen::Vector3d::Zero();      // of the output before, in the world, m/s
  Eigen::Vector3d omega_ = Eigen::Vector3d::Zero();  // rad/s
};

}  // namespace kilvo
