#include "lab/doctor/gyro_path.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo::lab {

Eigen::Vector3d log_of(const Eigen::Quaterniond& q) {
  const double s = q.w() < 0 ? -1 : 1, sine = q.vec().norm();
  if (sine < 1e-9) return 2 * s * q.vec();
  return 2 * std::atan2(sine, s * q.w()) / sine * s * q.vec();
}

Eigen::Quaterniond exp_of(const Eigen::Vector3d& v) {
  const double a = v.norm();
  const double k = a < 1e-9 ? 0.5 : std::sin(0.5 * a) / a;
  return {std::cos(0.5 * a), k * v.x(), k * v.y(), k * v.z()};
}

GyroPath::GyroPath(const std::vector<InertialSample>& imu, const Eigen::Matrix3d& axes, const Eigen::Vector3d& bias) {
  t_.reserve(imu.size());
  R_.reserve(imu.size());
  forces_.reserve(imu.size());
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  const InertialSample* before = nullptr;
  for (const InertialSample& s : imu) {
    if (before != nullptr) {
      const double dt = s.t - before->t;
      if (!(dt > 0)) continue;
      const Eigen::Vector3d mean = axes * (0.5 * (s.gyro + before->gyro)) - bias;
      R = (R * exp_of(mean * dt)).normalized();
    }
    before = &s;
    t_.push_back(s.t);
    R_.push_back(R);
    forces_.push_back(s.accel + (forces_.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : forces_.back()));
  }
}

Eigen::Quaterniond GyroPath::at(double t) const {
  const auto after = std::ranges::upper_bound(t_, t);
  if (after == t_.begin()) return R_.front();
  if (after == t_.end()) return R_.back();
  const auto i = static_cast<std::size_t>(after - t_.begin());
  const double share = (t - t_[i - 1]) / (t_[i] - t_[i - 1]);
  return R_[i - 1] * exp_of(share * log_of(R_[i - 1].conjugate() * R_[i]));
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
