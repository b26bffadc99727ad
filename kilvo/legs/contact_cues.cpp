#include "kilvo/legs/contact_cues.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

constexpr double smooth_force = 0.03, smooth_load = 0.02;        // s
constexpr double shortest_leg = 0.1;                             // m
constexpr Duration stop_window = std::chrono::milliseconds(20);  // of a stop; it is over between two samples that are farther apart

Eigen::Vector3d centre_of(const FootPose& foot) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < foot.corners; ++i) sum += foot.p[static_cast<std::size_t>(i)];
  return sum / std::max(1, foot.corners);
}

}  // namespace

// A foot that comes down is stopped within milliseconds: it has lost more than half of its speed, and its descent has begun to end.
bool CueTracker::Stop::add(const Sample& s, double threshold) {
  constexpr double left_over = 0.45, descent = 0.3, end_of_descent = 0.7;
  samples_[count_++ % most] = s;
  double fastest = 0, down = 0;
  for (std::size_t back = 0; back < std::min(count_, most); ++back) {
    const Sample& old = samples_[(count_ - 1 - back) % most];
    if (s.t - old.t > stop_window) break;
    fastest = std::max(fastest, old.speed);
    down = std::min(down, old.vertical);
  }
  return s.speed < left_over * fastest && fastest > threshold && down < -descent * threshold && s.vertical > end_of_descent * down;
}

void CueTracker::restart() {
  last_.reset();
  for (Stop& stop : stop_) stop.clear();
}

// The resultant of the ground's forces goes through the feet that carry and, but for the change of angular momentum, through the body.
double CueTracker::side_of_force(const Feet& feet, const State& x) const {
  constexpr double least_force = 2, least_apart = 0.05;  // m/s^2, leg lengths
  const Eigen::Vector2d meets = -leg_length_ / std::max(least_force, force_.z()) * force_.head<2>();
  const Eigen::Vector2d l = (x.R * centre_of(feet.foot[0])).head<2>(), r = (x.R * centre_of(feet.foot[1])).head<2>();
  const double apart2 = std::max((l - r).squaredNorm(), least_apart * least_apart * leg_length_ * leg_length_);
  return std::clamp((meets - r).dot(l - r) / apart2, -5.0, 6.0);
}

ContactCues CueTracker::update(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, const Eigen::Vector3d& force_W,
                               double threshold) {
  ContactCues out;
  out.dt = last_ ? std::clamp(to_seconds(feet.t - *last_), 0.0, to_seconds(least_silence)) : 0;
  const Eigen::Vector3d up_W = -x.g.normalized();
  leg_length_ = std::max(shortest_leg, up_W.dot(x.p) - std::min(up_W.dot(motion[0].lowest), up_W.dot(motion[1].lowest)));
  const double load = force_W.norm();
  if (!last_) {
    force_ = force_W;
    load_ = load;
  }
  last_ = feet.t;
  force_ += (1 - std::exp(-out.dt / smooth_force)) * (force_W - force_);
  load_ += (1 - std::exp(-out.dt / smooth_load)) * (load - load_);

  const double unit = std::sqrt(standard_gravity * leg_length_);
  for (std::size_t side = 0; side < 2; ++side) {
    out.speed[side] = motion[side].speed / unit;
    out.impact[side] =
        stop_[side].add({feet.t, motion[side].velocity.norm(), motion[side].vertical}, threshold) && out.dt < to_seconds(stop_window);
  }
  out.height = (motion[0].height - motion[1].height) / leg_length_;
  out.force_side = side_of_force(feet, x);
  out.load = load_ / standard_gravity;
  return out;
}

}  // namespace kilvo
