#include "lab/doctor/gyro_path.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo::lab {

Eigen::Vector3d log_of(const Eigen::Quaterniond& q) {
  const double s = q.w() < 0 ? -1 : 1, square = q.vec().squaredNorm(), r = square / (q.w() * q.w());
  // The arc tangent's series, exact to rounding.
  if (r < 1e-3) return 2 * (1 - r * (1.0 / 3 - r * (1.0 / 5 - r * (1.0 / 7 - r / 9)))) / q.w() * q.vec();
  const double sine = std::sqrt(square);
  return 2 * std::atan2(sine, s * q.w()) / sine * s * q.vec();
}

Eigen::Quaterniond exp_of(const Eigen::Vector3d& v) {
  const double a2 = v.squaredNorm();
  // Between two samples of an IMU: the series, exact to rounding.
  if (a2 < 1e-4) {
    const double k = 0.5 - a2 / 48 + a2 * a2 / 3840;
    return {1 - a2 / 8 + a2 * a2 / 384, k * v.x(), k * v.y(), k * v.z()};
  }
  const double a = std::sqrt(a2), k = std::sin(0.5 * a) / a;
  return {std::cos(0.5 * a), k * v.x(), k * v.y(), k * v.z()};
}

GyroPath::GyroPath(const std::vector<InertialSample>& imu, const Eigen::Matrix3d& axes, const Eigen::Vector3d& bias) {
  t_.reserve(imu.size());
  R_.reserve(imu.size());
  steps_.reserve(imu.size());
  forces_.reserve(imu.size());
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  const InertialSample* before = nullptr;
  for (const InertialSample& s : imu) {
    if (before != nullptr) {
      const double dt = s.t - before->t;
      if (!(dt > 0)) continue;
      steps_.emplace_back((axes * (0.5 * (s.gyro + before->gyro)) - bias) * dt);
      R = (R * exp_of(steps_.back())).normalized();
    } else {
      steps_.emplace_back(Eigen::Vector3d::Zero());
    }
    before = &s;
    t_.push_back(s.t);
    R_.push_back(R);
    forces_.push_back(s.accel + (forces_.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : forces_.back()));
  }
}

Eigen::Quaterniond GyroPath::at(double t) const {
  if (t < t_.front()) return R_.front();
  if (t >= t_.back()) return R_.back();
  // The first sample after `t` is near where it would be at a constant rate.
  const double last = static_cast<double>(t_.size() - 1), expected = (t - t_.front()) / (t_.back() - t_.front()) * last;
  constexpr double near = 8;  // samples
  auto from = t_.begin() + static_cast<std::ptrdiff_t>(std::max(expected - near, 0.0));
  auto to = t_.begin() + static_cast<std::ptrdiff_t>(std::min(expected + near, last));
  if (t < *from || t >= *to) from = t_.begin(), to = t_.end();
  const auto i = static_cast<std::size_t>(std::upper_bound(from, to, t) - t_.begin());
  const double share = (t - t_[i - 1]) / (t_[i] - t_[i - 1]);
  return R_[i - 1] * exp_of(share * steps_[i]);
}

Eigen::Vector3d GyroPath::rate(double a, double b) const { return log_of(between(a, b)) / (b - a); }

Eigen::Vector3d GyroPath::force(double a, double b) const {
  const auto before = [this](double t) {
    return std::clamp<std::ptrdiff_t>(std::ranges::upper_bound(t_, t) - t_.begin() - 1, 0, std::ssize(t_) - 1);
  };
  const std::ptrdiff_t i = before(a), j = before(b);
  const auto sum = [this](std::ptrdiff_t k) { return forces_[static_cast<std::size_t>(k)]; };
  return j > i ? Eigen::Vector3d((sum(j) - sum(i)) / static_cast<double>(j - i)) : Eigen::Vector3d::Zero();
}

}  // namespace kilvo::lab
