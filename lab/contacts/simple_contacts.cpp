#include "lab/contacts/simple_contacts.hpp"

#include <algorithm>

namespace kilvo::lab {
namespace {

using std::chrono::milliseconds;

constexpr double share_of_weight = 0.2;
constexpr Duration weighing = milliseconds(500);
// A variance this many times the usual one is an impact; the usual one is a mean over so long, s; no two impacts are nearer than that.
constexpr double impact_factor = 2, usual_time = 2;
constexpr Duration variance_window = milliseconds(50), nearest_impacts = milliseconds(150);
// Less variance than this is no walking, (m/s^2)^2.
constexpr double least_variance = 0.05;

}  // namespace

bool ContactReport::begin(const Feet& feet, const State& x) {
  const Eigen::Vector3d up_W = -x.g.normalized(), up_I = x.R.matrix().transpose() * up_W;
  contacts_.t = feet.t;
  contacts_.normal = up_W;
  for (std::size_t side = 0; side < 2; ++side) lowest_[side] = x.pose() * lowest_point(feet.foot[side], up_I).p;
  const bool first = !started_;
  started_ = true;
  if (first) {
    contacts_.on = {true, true};
    contacts_.probability = {1, 1};
    contacts_.since = {feet.t, feet.t};
  }
  for (std::size_t side = 0; side < 2; ++side) {
    if (contacts_.on[side]) contacts_.ground[side] = {up_W, lowest_[side], 0};
    contacts_.clearance[side] = contacts_.ground[side].height_of(lowest_[side]);
  }
  return first;
}

void ContactReport::set(std::size_t side, bool on) {
  if (contacts_.on[side] == on) return;
  contacts_.on[side] = on;
  contacts_.probability[side] = on ? 1 : 0;
  contacts_.since[side] = contacts_.t;
}

const Contacts& ForceContacts::update(const Feet& feet, const State& x, const Eigen::Vector3d& /*omega*/, const Eigen::Vector3d& /*accel*/,
                                      double /*sigma_v*/, const VoxelMap* /*map*/) {
  begin(feet, x);
  if (!feet.force_I) return contacts_;
  const Eigen::Vector3d up_I = x.R.matrix().transpose() * -x.g.normalized();
  const std::array<double, 2> force = {up_I.dot((*feet.force_I)[0]), up_I.dot((*feet.force_I)[1])};
  if (samples_ == 0) since_ = feet.t;
  if (feet.t - since_ <= weighing) {
    ++samples_;
    weight_ += (force[0] + force[1] - weight_) / samples_;
    return contacts_;
  }
  for (std::size_t side = 0; side < 2; ++side) set(side, force[side] > share_of_weight * weight_);
  return contacts_;
}

const Contacts& VarianceContacts::update(const Feet& feet, const State& x, const Eigen::Vector3d& /*omega*/, const Eigen::Vector3d& accel,
                                         double /*sigma_v*/, const VoxelMap* /*map*/) {
  const Time before = contacts_.t;
  if (begin(feet, x)) {
    count_ = 0;
    last_event_ = feet.t;
    highest_ = {};
  }
  const Eigen::Vector3d up_W = -x.g.normalized();
  for (std::size_t side = 0; side < 2; ++side) {
    highest_[side] = std::max(highest_[side], up_W.dot(lowest_[side] - lowest_[1 - side]));
  }
  if (count_ > 0 && feet.t - last_sample_ < std::chrono::microseconds(900)) return contacts_;
  last_sample_ = feet.t;
  norms_[count_++ % window] = accel.norm();
  // The window is 50 ms, at low rates fewer samples, but four at least.
  const double period = std::clamp(to_seconds(feet.t - before), 1e-3, 0.05);
  const auto wanted = static_cast<std::size_t>(std::clamp(to_seconds(variance_window) / period, 4.0, static_cast<double>(window)));
  if (count_ < wanted) return contacts_;
  double mean = 0, square = 0;
  for (std::size_t back = 0; back < wanted; ++back) {
    const double a = norms_[(count_ - 1 - back) % window];
    mean += a / static_cast<double>(wanted);
    square += a * a / static_cast<double>(wanted);
  }
  const double variance = std::max(0.0, square - mean * mean);
  const bool impact = variance > std::max(least_variance, impact_factor * usual_) && feet.t - last_event_ > nearest_impacts;
  usual_ += std::min(1.0, period / usual_time) * (variance - usual_);
  if (!impact) return contacts_;
  const std::size_t landed = highest_[0] > highest_[1] ? 0 : 1;
  set(landed, true);
  set(1 - landed, false);
  last_event_ = feet.t;
  highest_ = {};
  return contacts_;
}

}  // namespace kilvo::lab
