#include "kilvo/lidar/mount_error.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace kilvo {
namespace {

constexpr Duration window = std::chrono::milliseconds(250);  // longer is noisier by the gyro, shorter by the sweeps
constexpr double fewest_windows = 10;
constexpr double outlier = 3;                       // standard deviations, from which on a window counts less
constexpr double best_mount = 0.02 * (M_PI / 180);  // no description is more exact
constexpr double worst_mount = 3 * (M_PI / 180);    // worse ones are found by other means

/// Of elements that are measured with the given noise variances and come from a normal distribution of mean zero: the expected standard
/// deviation of that. Beforehand each order of magnitude between the best and the worst mount is as likely as any other.
double expected_sigma(const Eigen::Array<double, 9, 1>& squares, const Eigen::Array<double, 9, 1>& noise) {
  constexpr int steps = 64;
  std::array<double, steps> sigmas, logs;
  const double lowest = 0.1 * best_mount, ratio = std::pow(worst_mount / lowest, 1.0 / (steps - 1));
  double sigma = lowest;
  for (int i = 0; i < steps; ++i, sigma *= ratio) {
    const Eigen::Array<double, 9, 1> total = noise + sigma * sigma;
    sigmas[i] = sigma;
    logs[i] = std::log(sigma / (best_mount + sigma)) - 0.5 * (total.log() + squares / total).sum();
  }
  const double largest = *std::max_element(logs.begin(), logs.end());
  double sum = 0, weights = 0;
  for (int i = 0; i < steps; ++i) {
    const double weight = std::exp(logs[i] - largest);
    sum += weight * sigmas[i];
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

void MountError::add(Time t, const SO3& R_WI, const Trajectory& trajectory) {
  if (since_ && t - since_->t < window) return;
  const auto begin = since_ ? trajectory.at(since_->t) : std::nullopt, end = trajectory.at(t);
  if (begin && end) {
    const SO3 by_gyro = begin->R.inverse() * end->R;
    const Eigen::Vector3d D = (by_gyro.inverse() * since_->R_WI.inverse() * R_WI).Log();
    const Regressors x(by_gyro.Log().x(), by_gyro.Log().y(), by_gyro.Log().z(), to_seconds(t - since_->t));
    const double w = noise_ > 0 ? 1 / (1 + D.squaredNorm() / (outlier * outlier * 3 * noise_)) : 1;
    xx_ += w * x * x.transpose();
    Dx_ += w * D * x.transpose();
    DD_ += w * D.squaredNorm();
    weight_ += w;
    if (weight_ >= fewest_windows) learn();
  }
  since_ = Window{t, R_WI};
}

void MountError::learn() {
  constexpr double hardly_any = 1e-9;  // rad^2, s^2: who stands has not turned
  const Eigen::Matrix4d inverse = (xx_ + hardly_any * Eigen::Matrix4d::Identity()).inverse();
  const Eigen::Matrix<double, 3, 4> M = Dx_ * inverse;
  noise_ = std::max((DD_ - M.cwiseProduct(Dx_).sum()) / (3 * weight_ - static_cast<double>(M.size())), 1e-14);
  Eigen::Array<double, 9, 1> squares, noise;
  for (int i = 0; i < 3; ++i) {
    squares.segment<3>(3 * i) = M.col(i).array().square();
    noise.segment<3>(3 * i) = noise_ * inverse(i, i);
  }
  sigma_ = expected_sigma(squares, noise);
}

// With a mount that is wrong by the rotation d and the shift s, all poses R, p since the first R0, p0 are R0 Exp(-d) R0^T R Exp(d) and
// p0 + R0 Exp(-d) R0^T (p - p0) + (R - R0) s: nothing else makes them agree with the first.
PoseCovariance MountError::at(const SE3& T_WI) const {
  const Eigen::Matrix3d R0 = first_.R.matrix(), R = T_WI.R.matrix();
  Eigen::Matrix<double, 6, 6> J;
  J.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() - R.transpose() * R0;
  J.bottomLeftCorner<3, 3>() = R0 * skew(R0.transpose() * (T_WI.p - first_.p));
  J.topRightCorner<3, 3>().setZero();
  J.bottomRightCorner<3, 3>() = R - R0;  // what tilts a bracket by an angle moves its end by the angle times a length of a metre
  return sigma_ * sigma_ * J * J.transpose();
}

}  // namespace kilvo
