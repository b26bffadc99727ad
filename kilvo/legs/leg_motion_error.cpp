#include "kilvo/legs/leg_motion_error.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

namespace kilvo {
namespace {

// Standard deviations that a careful description leaves, of each element of M: of what is alike for as long as the robot is the same, and
// of what differs from one ground and gait to the next. Of the scale of the gyro, by data sheets.
constexpr double lasting = 0.0087, varying = 0.005, gyro_scale = 0.003;
// Of the bias of a gyro that warms up, rad/s^2: 0.004 rad/s within minutes.
constexpr double gyro_drift = 2e-5;
// A load lasts for about so long, s.
constexpr double load_memory = 300;

// Effect of a matrix M on the displacement R v of the body, by its columns.
Eigen::Matrix<double, 3, 9> effect_of(const Eigen::Matrix3d& R, const Eigen::Vector3d& v) {
  Eigen::Matrix<double, 3, 9> out;
  for (int j = 0; j < 3; ++j) out.middleCols<3>(3 * j) = v[j] * R;
  return out;
}

}  // namespace

LegMotionError::LegMotionError() : P_(lasting * lasting * Eigen::Matrix<double, 9, 9>::Identity()) {}

void LegMotionError::pose_is_measured(const Eigen::Matrix3d& unknown) {
  by_legs_ = unknown * by_legs_;
  by_gyro_ = unknown * by_gyro_;
  by_drift_ = unknown * by_drift_;
  turned_ = alone_for_ = 0;
  measured_ = is_known_ = unknown.isZero(0);
}

void LegMotionError::add(const State& x, const Eigen::Vector3d& velocity_I, double weight, double dt, bool alone) {
  if (!x.p.allFinite() || !x.v.allFinite() || !x.R.matrix().allFinite() || !x.g.allFinite()) return;  // a state that is discarded
  constexpr double window = 1, longest = 3;                                                           // s
  const Eigen::Vector3d up_W = -x.g.normalized();
  if (alone || !is_known_) {
    constexpr double least_step2 = 0.005 * 0.005;  // m^2: nothing changes within less
    comparison_.reset();
    alone_for_ += dt;
    if (last_) {
      const Eigen::Vector3d step = x.p - last_->p;
      if (step.squaredNorm() < least_step2) return;
      turned_ += up_W.dot(last_->R * (last_->R.inverse() * x.R).Log());
      by_legs_ += effect_of(x.R.matrix(), x.R.inverse() * step);
      by_gyro_ += turned_ * up_W.cross(step);
      by_drift_ += 0.5 * alone_for_ * alone_for_ * up_W.cross(step);
    }
    last_ = x.pose();
    return;
  }
  last_.reset();
  if (comparison_) {
    Comparison& c = *comparison_;
    c.time += dt;
    c.weight += weight * dt;
    c.off += weight * dt * (x.R * velocity_I - x.v);
    c.effect += weight * dt * effect_of(x.R.matrix(), velocity_I);
    if (c.time > longest) comparison_.reset();
    if (measured_ && c.time > window) learn(up_W);
  }
  if (measured_ && !comparison_) comparison_ = Comparison{};
  measured_ = false;
}

void LegMotionError::learn(const Eigen::Vector3d& up_W) {
  // Noise of the displacement of one second, m; share of time in stance; Huber's gate.
  constexpr double sigma = 0.0025, least_weight = 0.1, gate2 = 9;
  const Comparison c = *std::exchange(comparison_, std::nullopt);
  P_.diagonal().array() += lasting * lasting * c.time / load_memory;
  if (c.weight < least_weight * c.time) return;
  const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - up_W * up_W.transpose()) * (c.time / c.weight);
  const Effect H = across * c.effect;
  const Eigen::Vector3d off = across * c.off - H * (M_ - corrected_).reshaped();
  Eigen::Matrix3d S = H * P_ * H.transpose();
  S.diagonal().array() += sigma * sigma;
  const double chi2 = off.dot(S.llt().solve(off));
  if (chi2 > gate2) S.diagonal().array() += (chi2 / gate2 - 1) * sigma * sigma;
  const Eigen::Matrix<double, 9, 3> K = P_ * H.transpose() * S.inverse();
  const Eigen::Matrix<double, 9, 1> more = K * off;
  M_ += more.reshaped(3, 3);
  P_ -= (K * S * K.transpose()).eval();
  // Shrunk towards the description (James and Stein 1961): what is no more than the noise changes nothing.
  constexpr double dimensions = 2;
  corrected_ = M_ * std::max(0.0, 1 - dimensions / std::max(dimensions, M_.reshaped().dot(P_.llt().solve(M_.reshaped()))));
}

PoseCovariance LegMotionError::error(const State& x) const {
  PoseCovariance out = PoseCovariance::Zero();
  if (!by_legs_.isZero(0))
    out.bottomRightCorner<3, 3>() = by_legs_ * (P_ + varying * varying * Eigen::Matrix<double, 9, 9>::Identity()) * by_legs_.transpose();
  const Eigen::Vector3d up_I = x.R.inverse() * -x.g.normalized();
  Eigen::Matrix<double, 6, 1> by_gyro, by_drift;
  by_gyro << turned_ * up_I, by_gyro_;
  by_drift << 0.5 * alone_for_ * alone_for_ * up_I, by_drift_;
  out += gyro_scale * gyro_scale * by_gyro * by_gyro.transpose() + gyro_drift * gyro_drift * by_drift * by_drift.transpose();
  return out;
}

}  // namespace kilvo
