// The turning that a gyro measured, between any two times.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "kilvo/math/so3.hpp"
#include "lab/doctor/recorded.hpp"

namespace kilvo::lab {

class GyroPath {
 public:
  /// `axes`: takes what the gyro wrote to rad/s about the axes of the IMU frame. `bias`: rad/s, in the IMU frame.
  GyroPath(const std::vector<InertialSample>& imu, const Eigen::Matrix3d& axes, const Eigen::Vector3d& bias);

  double begin() const { return t_.front(); }
  double end() const { return t_.back(); }
  bool covers(double a, double b) const { return !t_.empty() && a >= begin() && b <= end(); }
  /// R_ab: takes a vector of the IMU frame at `b` into that at `a`. Both within [begin, end].
  Eigen::Quaterniond between(double a, double b) const { return at(a).conjugate() * at(b); }
  /// From the IMU frame at `t` to that at the beginning.
  Eigen::Quaterniond at(double t) const;
  /// rad/s, mean from a to b, in the IMU frame in the middle between (first order).
  Eigen::Vector3d rate(double a, double b) const;
  /// Mean of what the accelerometer wrote from a to b, by the nearest samples.
  Eigen::Vector3d force(double a, double b) const;

 private:
  std::vector<double> t_;
  std::vector<Eigen::Quaterniond> R_;
  std::vector<Eigen::Vector3d> steps_;   // rad: the turn until each time from the one before
  std::vector<Eigen::Vector3d> forces_;  // sum of those until each time
};

/// Rotation vector of a quaternion.
Eigen::Vector3d log_of(const Eigen::Quaterniond& q);
Eigen::Quaterniond exp_of(const Eigen::Vector3d& v);

}  // namespace kilvo::lab
