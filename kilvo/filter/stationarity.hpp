// Detects whether an IMU is at rest.
#pragma once

#include <optional>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// theta_d of the paper: what is so many standard deviations from its usual is an impact, a motion.
inline constexpr double unusual_deviation = 10;
/// A mean rate that is larger, beyond the bias that is known, is motion, rad/s.
inline constexpr double largest_resting_rate = 0.03;

/// Mean and variance of the acceleration over the last seconds.
class UsualAcceleration {
 public:
  /// d_a: the deviation of this sample from the mean, in standard deviations, summed over the axes. `dt`: since the sample before, s.
  double deviation(const Eigen::Vector3d& accel, double dt);

 private:
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero(), variance_ = Eigen::Vector3d::Zero();
};

/// Detects from IMU samples alone whether the robot stands still, and whether the acceleration is usual. It keeps no samples.
class StationarityDetector {
 public:
  /// The robot stands still while the standard deviations of rate (rad/s) and acceleration (m/s^2) are below these.
  StationarityDetector(double still_gyro, double still_accel) : still_gyro_(still_gyro), still_accel_(still_accel) {}

  /// `gyro_bias`: as far as it is known; what is left of the mean rate is motion.
  void add(const ImuSample& s, const Eigen::Vector3d& gyro_bias);
  void restart();
  /// The IMU has looked like one of a standing robot for at least half a second.
  bool stands() const { return quiet_blocks_ >= 2; }
  /// The acceleration has been a usual one for at least `hold`.
  bool is_usual(Time t, Duration hold) const { return usual_since_ && t - *usual_since_ >= hold; }

 private:
  void close_block(const Eigen::Vector3d& gyro_bias);

  double still_gyro_, still_accel_;
  std::optional<Time> begin_, last_, usual_since_;
  double n_ = 0;
  Eigen::Vector3d gyro_ = Eigen::Vector3d::Zero(), gyro2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_ = Eigen::Vector3d::Zero(), accel2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d resting_gyro_ = Eigen::Vector3d::Zero();
  UsualAcceleration usual_;
  int quiet_blocks_ = 0;
};

}  // namespace kilvo
