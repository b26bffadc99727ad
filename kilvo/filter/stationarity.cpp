#include "kilvo/filter/stationarity.hpp"

#include <algorithm>

namespace kilvo {

double UsualAcceleration::deviation(const Eigen::Vector3d& accel, double dt) {
  constexpr double statistics_time = 2.0, least_variance = 1e-4;  // s, (m/s^2)^2
  if (mean_.isZero(0)) mean_ = accel;
  const Eigen::Vector3d off = accel - mean_;
  const double out = (off.array().abs() / (variance_.array() + least_variance).sqrt()).sum();
  const double share = std::clamp(dt / statistics_time, 0.0, 1.0);
  mean_ += share * off;
  variance_ += share * (off.cwiseAbs2() - variance_);
  return out;
}

void StationarityDetector::restart() {
  begin_.reset();
  usual_since_.reset();
  quiet_blocks_ = 0;
}

void StationarityDetector::close_block(const Eigen::Vector3d& gyro_bias) {
  const Eigen::Vector3d gyro = gyro_ / n_, accel = accel_ / n_;
  const Eigen::Vector3d gyro_sigma = (gyro2_ / n_ - gyro.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
  const Eigen::Vector3d accel_sigma = (accel2_ / n_ - accel.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
  constexpr double largest_change = 0.01;  // rad/s
  const bool quiet = n_ > 5 && gyro_sigma.maxCoeff() < still_gyro_ && accel_sigma.maxCoeff() < still_accel_ &&
                     (gyro - gyro_bias).norm() < largest_resting_rate &&
                     (quiet_blocks_ == 0 || (gyro - resting_gyro_).norm() < largest_change);
  quiet_blocks_ = quiet ? quiet_blocks_ + 1 : 0;
  resting_gyro_ = gyro;
}

void StationarityDetector::add(const ImuSample& s, const Eigen::Vector3d& gyro_bias) {
  if (!begin_) {
    begin_ = s.t;
    n_ = 0;
    gyro_.setZero(), gyro2_.setZero(), accel_.setZero(), accel2_.setZero();
  }
  n_ += 1;
  gyro_ += s.gyro;
  gyro2_ += s.gyro.cwiseAbs2();
  accel_ += s.accel;
  accel2_ += s.accel.cwiseAbs2();
  const double dt = last_ ? std::clamp(to_seconds(s.t - *last_), 0.0, 0.1) : 0.0;
  last_ = s.t;
  if (usual_.deviation(s.accel, dt) >= unusual_deviation) {
    usual_since_.reset();
  } else if (!usual_since_) {
    usual_since_ = s.t;
  }
  constexpr double block = 0.25;  // s
  if (to_seconds(s.t - *begin_) < block) return;
  close_block(gyro_bias);
  begin_.reset();
}

}  // namespace kilvo
