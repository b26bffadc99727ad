#include "apps/live/smooth_odometry.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

// However large a correction is, it moves the pose no faster, m/s, rad/s; and however long nothing came, one output takes in no more than
// so many seconds of it.
constexpr double most_moved = 1, most_turned = 1, most_time = 0.2;

Eigen::Vector3d at_most(const Eigen::Vector3d& v, double length) {
  const double n = v.norm();
  return n > length ? Eigen::Vector3d(v * (length / n)) : v;
}

}  // namespace

SE3 SmoothOdometry::add(const Output& output) {
  const State& x = output.x;
  if (!t_) {
    pose_ = x.pose();
  } else {
    const double dt = to_seconds(output.t - *t_);
    // The motion since, by what is known of the velocities at both ends.
    pose_.p += 0.5 * dt * (v_ + x.v);
    pose_.R = pose_.R * SO3::Exp(0.5 * dt * (omega_ + output.omega));
    const double share = -std::expm1(-dt / time_);
    const double taken = std::min(dt, most_time);
    pose_.p += at_most(share * (x.p - pose_.p), taken * most_moved);
    pose_.R = pose_.R * SO3::Exp(at_most(share * (pose_.R.inverse() * x.R).Log(), taken * most_turned));
  }
  t_ = output.t;
  v_ = x.v;
  omega_ = output.omega;
  return pose_;
}

}  // namespace kilvo
