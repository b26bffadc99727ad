// The specific force along the turns of the gyro, integrated twice.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <iterator>
#include <vector>

#include "lab/doctor/gyro_path.hpp"

namespace kilvo::lab {

/// The specific force integrated twice, in the frame of the IMU at the beginning.
class ForceIntegral {
 public:
  ForceIntegral(const std::vector<InertialSample>& imu, const GyroPath& gyro) {
    for (const InertialSample& s : imu) {
      if (!gyro.covers(s.t, s.t) || (!steps_.empty() && s.t <= steps_.back().t)) continue;
      const Eigen::Matrix3d R = gyro.at(s.t).toRotationMatrix();
      Step next{s.t, R * s.accel, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), R, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
      if (!steps_.empty()) {
        const Step& last = steps_.back();
        const double dt = next.t - last.t;
        next.v = last.v + 0.5 * dt * (last.f + next.f);
        next.p = last.p + dt * last.v + dt * dt * (last.f / 3 + next.f / 6);
        next.Rv = last.Rv + 0.5 * dt * (last.R + next.R);
        next.Rp = last.Rp + dt * last.Rv + dt * dt * (last.R / 3 + next.R / 6);
      }
      steps_.push_back(next);
    }
  }
  bool covers(double a, double b) const { return steps_.size() > 1 && a >= steps_.front().t && b <= steps_.back().t; }
  Eigen::Vector3d place(double t) const {
    const Step& s = before(t);
    const double dt = t - s.t;
    return s.p + dt * s.v + 0.5 * dt * dt * s.f;
  }
  Eigen::Matrix3d place_by_bias(double t) const {
    const Step& s = before(t);
    const double dt = t - s.t;
    return s.Rp + dt * s.Rv + 0.5 * dt * dt * s.R;
  }
  /// Integral of the rotation of the IMU, by which its gyro's bias turns.
  const Eigen::Matrix3d& turned(double t) const { return before(t).Rv; }
  /// Whether some sole bears the robot: in flight it falls, and its accelerometer measures nothing.
  bool is_borne(double t) const {
    constexpr double half = 0.025, share = 0.5;  // s, of gravity
    const Step &a = before(t - half), &b = before(t + half);
    return (b.v - a.v).norm() > share * gravity().norm() * (b.t - a.t);
  }
  Eigen::Vector3d gravity() const { return -(steps_.back().v - steps_.front().v) / (steps_.back().t - steps_.front().t); }
  /// Upwards, about this time.
  Eigen::Vector3d up(double t) const {
    constexpr double half = 0.5;  // s
    return (before(t + half).v - before(t - half).v).normalized();
  }

 private:
  struct Step {
    double t;
    Eigen::Vector3d f, v, p;
    Eigen::Matrix3d R, Rv, Rp;
  };
  const Step& before(double t) const {
    const auto after = std::ranges::upper_bound(steps_, t, {}, &Step::t);
    return after == steps_.begin() ? *after : *std::prev(after);
  }
  std::vector<Step> steps_;
};

}  // namespace kilvo::lab
