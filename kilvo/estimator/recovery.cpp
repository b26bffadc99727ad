#include "kilvo/estimator/recovery.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

// A humanoid that walks: how fast it turns, how much it leans, how much its velocity changes and how far that takes it (one sigma).
constexpr double turning = 0.4;                        // rad/s
constexpr double leaning = 0.06;                       // rad
constexpr double velocity = 0.3, more_velocity = 0.1;  // m/s, m/s per s of the gap
constexpr double acceleration = 3.0;                   // m/s^2: in a short gap the velocity has not had the time to change by all that

constexpr double statistics_time = 2.0;  // s
constexpr double block = 0.25;           // s

}  // namespace

void inflate_covariance_over_gap(Estimate& e, Time begin, Time end, double gap) {
  const double share = gap > 0 ? std::clamp(to_seconds(end - begin) / gap, 0.0, 1.0) : 1.0;
  const double lean = std::min(leaning, turning * gap), turn = turning * gap;
  const double dv = std::min(velocity + more_velocity * gap, acceleration * gap), dp = dv * gap;
  // Leaning is about the horizontal, turning about the vertical.
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * -e.x.g.normalized();
  e.P.block<3, 3>(at::R, at::R) +=
      share * (lean * lean * Eigen::Matrix3d::Identity() + std::max(0.0, turn * turn - lean * lean) * up_I * up_I.transpose());
  e.P.diagonal().segment<3>(at::v).array() += share * dv * dv;
  e.P.diagonal().segment<3>(at::p).array() += share * dp * dp;
  // A velocity that changed somewhere in the gap was wrong for half of it.
  e.P.diagonal(at::v - at::p).segment<3>(at::p).array() += 0.5 * share * dv * dp;
  e.P.diagonal(at::p - at::v).segment<3>(at::p).array() += 0.5 * share * dv * dp;
}

void StationarityDetector::restart() {
  begin_.reset();
  usual_since_.reset();
  quiet_blocks_ = 0;
}

void StationarityDetector::close_block() {
  const Eigen::Vector3d gyro = gyro_ / n_, accel = accel_ / n_;
  const Eigen::Vector3d gyro_sigma = (gyro2_ / n_ - gyro.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
  const Eigen::Vector3d accel_sigma = (accel2_ / n_ - accel.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
  constexpr double largest_rate = 0.03, largest_change = 0.01;  // rad/s
  const bool quiet = n_ > 5 && gyro_sigma.maxCoeff() < config_.still_gyro && accel_sigma.maxCoeff() < config_.still_accel &&
                     gyro.norm() < largest_rate && (quiet_blocks_ == 0 || (gyro - resting_gyro_).norm() < largest_change);
  quiet_blocks_ = quiet ? quiet_blocks_ + 1 : 0;
  resting_gyro_ = gyro;
}

void StationarityDetector::add(const ImuSample& s) {
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
  constexpr double least_variance = 1e-4;  // (m/s^2)^2
  if (mean_.isZero(0)) mean_ = s.accel;
  const Eigen::Vector3d off = s.accel - mean_;
  const double d_a = (off.array().abs() / (variance_.array() + least_variance).sqrt()).sum();
  mean_ += dt / statistics_time * off;
  variance_ += dt / statistics_time * (off.cwiseAbs2() - variance_);
  if (d_a >= theta_) {
    usual_since_.reset();
  } else if (!usual_since_) {
    usual_since_ = s.t;
  }
  if (to_seconds(s.t - *begin_) < block) return;
  close_block();
  begin_.reset();
}

}  // namespace kilvo
