#include "kilvo/legs/stance_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kilvo {
namespace {

// The corners of a rolling sole that are this much faster than the slowest one carry e^-0.5 of its weight, m/s.
constexpr double rolling_speed = 0.005;
// The same as a share of what a supporting sole seems to move by.
constexpr double rolling_share = 0.3;
// Beyond the gate for so long, a foot has another place.
constexpr Duration longest_refusal = std::chrono::milliseconds(20);
// Encoders that repeat every bit, while the other foot's do not and the body turns faster than this (rad/s), are frozen.
constexpr double surely_turning = 0.1;
// How much one touchdown counts in what is learned of the ground.
constexpr double sink_share = 0.15;
// The variance of a new stance foot decreases over this time, s.
constexpr double entry_time = 0.02;
constexpr double shortest_step = 1e-4;  // s
// Height per distance from errors of the description and sinking soles: both feet show it, and it is no error of the state.
constexpr double described_share = 0.015;

// How much each corner of a sole carries, which adds up to one.
std::array<double, max_corners> share_of_corners(const FootPose& pose, const State& x, const Eigen::Vector3d& omega, double rolling) {
  std::array<double, max_corners> out{};
  double least = std::numeric_limits<double>::infinity();
  std::array<double, max_corners> speed2{};
  const auto corners = static_cast<std::size_t>(pose.corners);
  for (std::size_t k = 0; k < corners; ++k) {
    speed2[k] = velocity_W(x, pose.p[k], pose.v[k], omega).squaredNorm();
    least = std::min(least, speed2[k]);
  }
  double sum = 0;
  for (std::size_t k = 0; k < corners; ++k) {
    out[k] = std::exp((least - speed2[k]) / (2 * rolling * rolling));
    sum += out[k];
  }
  for (std::size_t k = 0; k < corners; ++k) out[k] /= sum;
  return out;
}

Eigen::Vector3d slowest_of(const FootPose& pose, const State& x, const Eigen::Vector3d& omega) {
  Eigen::Vector3d out = velocity_W(x, pose.p[0], pose.v[0], omega);
  for (std::size_t k = 1; k < static_cast<std::size_t>(pose.corners); ++k) {
    const Eigen::Vector3d v = velocity_W(x, pose.p[k], pose.v[k], omega);
    if (v.squaredNorm() < out.squaredNorm()) out = v;
  }
  return out;
}

// Eq. 8 for each row by itself: how much more it deviates than its noise.
Eigen::Matrix<double, 7, 1> scale_of_rows(const Eigen::Vector3d& velocity, double velocity2, const Eigen::Vector3d& position,
                                          double position2) {
  Eigen::Matrix<double, 7, 1> out = Eigen::Matrix<double, 7, 1>::Ones();
  out.head<3>() = (velocity.cwiseAbs2() / velocity2).cwiseMax(1.0);
  out.segment<3>(3) = (position.cwiseAbs2() / position2).cwiseMax(1.0);
  return out.cwiseMin(largest_scale * largest_scale);
}

}  // namespace

StanceTracker::StanceTracker(const LegConfig& config)
    : config_(config),
      step_height_(0, 0.01, 1, 5),
      noise_(config),
      by_foot_(config.adaptation == "foot"),
      by_row_(config.adaptation == "row"),
      has_heights_(config.height != "never"),
      by_contacts_(config.ground == "contacts") {}

void StanceTracker::restart() {
  for (Foot& foot : feet_) {
    foot.leaves = foot.leaves || foot.weights.has_value();
    foot.weights.reset();
  }
  last_.reset();
  noise_.restart();
}

void StanceTracker::judge(const LegStep& step, const std::array<bool, 2>& passed) {
  for (std::size_t side = 0; side < 2; ++side) {
    Foot& foot = feet_[side];
    if (!step.foot[side].used || passed[side]) {
      foot.refused_since.reset();
      continue;
    }
    if (!foot.refused_since) foot.refused_since = step.t;
    if (step.t - *foot.refused_since < longest_refusal) continue;
    foot.refused_since.reset();
    foot.leaves = true;
    foot.weights.reset();
  }
}

// A sole sinks into soft ground, grass hides it from the LiDAR, few points near the robot make a plane that is off: all of that is alike
// from step to step, so what it was while the LiDAR knew the height is taken off when it does not.
std::optional<GroundPatch> StanceTracker::ground_under(const VoxelMap& map, const Eigen::Vector3d& p_W, const Eigen::Vector3d& up_W,
                                                       Ground ground) {
  auto patch = GroundLookup::of_map(map, p_W, up_W);
  if (!patch) return std::nullopt;
  if (ground == Ground::learn) {
    const double off = patch->height_of(p_W) - sink_;
    sink_ += sink_share * off;
    sink_variance_ += sink_share * (off * off - sink_variance_);
    return std::nullopt;
  }
  patch->point += sink_ * patch->normal;
  patch->sigma = std::sqrt(patch->sigma * patch->sigma + sink_variance_ + config_.ground_sigma * config_.ground_sigma);
  return patch;
}

// The feet whose rows are used. Without a flight one foot is always in contact: when none is detected, the more probable.
std::array<bool, 2> StanceTracker::carriers(const Contacts& contacts, double dt) const {
  std::array<bool, 2> out = contacts.on;
  const auto [left, right] = contacts.probability;
  if (!out[0] && !out[1]) {
    if (contacts.flight) return out;
    const bool left_carries = left != right ? left > right : contacts.since[0] > contacts.since[1];
    out[left_carries ? 0 : 1] = true;
    return out;
  }
  const std::array<bool, 2> in = {feet_[0].weights.has_value(), feet_[1].weights.has_value()};
  for (std::size_t side = 0; side < 2; ++side) {
    const double phase = contacts.phase(side) + dt;
    const std::size_t other = 1 - side;
    if (!contacts.on[side] || in[side]) continue;
    // The impact of a foot that comes down moves what is measured of the other one, too: it stays, unless it has surely left.
    if (in[other] && phase < config_.entry_delay + entry_time && contacts.probability[other] > 1 - ContactFilter::sure_of_state)
      out[other] = true;
    // It settles first, while the other carries.
    const bool can_wait = in[other] || contacts.phase(other) > contacts.phase(side);
    if (out[other] && can_wait && phase < config_.entry_delay) out[side] = false;
  }
  return out;
}

// A step up or down is as likely as the last ones were high.
std::optional<GroundPatch> StanceTracker::level_with_other(std::size_t side, const Eigen::Vector3d& p_W, const State& x,
                                                           const Eigen::Vector3d& normal_W) {
  constexpr double least_step = 0.005, most_step = 0.03;  // m
  // The normal of the ground is off by the same for many steps.
  constexpr double doubt = 2;
  if (!feet_[1 - side].weights) return std::nullopt;
  const double height = normal_W.dot(p_W - x.pc[1 - side]);
  const double sigma = std::clamp(doubt * step_height_.rms(), least_step, most_step);
  if (std::abs(height) < stair) step_height_.add(height, 1);
  return GroundPatch{normal_W, x.pc[1 - side], sigma};
}

// The ground under a foot that has just come down.
void StanceTracker::add_ground(std::size_t side, Stance& foot, const State& x, const VoxelMap* map, const Eigen::Vector3d& normal_W,
                               Ground ground) {
  const Eigen::Vector3d p_W = x.pose() * foot.point.p, up_W = -x.g.normalized();
  if (by_contacts_) {
    if (ground == Ground::use) foot.ground = places_.of_contacts(up_W);
    if (foot.ground) foot.ground->sigma = std::hypot(foot.ground->sigma, config_.ground_sigma);
    places_.stands_at(p_W);
    return;
  }
  if (map != nullptr) foot.ground = ground_under(*map, p_W, up_W, ground);
  if (!foot.ground && ground == Ground::use) foot.level = level_with_other(side, p_W, x, normal_W);
}

// True while the encoders of this foot are frozen.
bool StanceTracker::stuck(std::size_t side, const Feet& feet, const Eigen::Vector3d& omega) {
  const FootPose& now = feet.foot[side];
  Foot& foot = feet_[side];
  const FootPose& last = foot.last_pose;
  if (now.corners != last.corners || now.p[0] != last.p[0] || now.v[0] != last.v[0]) foot.changed = feet.t;
  foot.last_pose = now;
  return feet.t - foot.changed > least_silence && feet_[1 - side].changed > foot.changed && omega.norm() > surely_turning;
}

LegStep StanceTracker::step(const Feet& feet, const Contacts& contacts, const State& x, const Eigen::Vector3d& omega, double sigma_v,
                            const Support& support) {
  LegStep out;
  out.t = feet.t;
  const double longest_step = to_seconds(least_silence);
  out.dt = last_ ? std::clamp(to_seconds(feet.t - *last_), shortest_step, longest_step) : longest_step;
  const std::array<bool, 2> carries = carriers(contacts, last_ ? out.dt : 0);
  last_ = feet.t;
  out.velocity_sigma = noise_.horizontal();
  out.vertical_velocity_sigma = noise_.vertical();
  out.gyro_bias = standing_rate_.add(feet, contacts, omega + x.bg);
  for (std::size_t side = 0; side < 2; ++side) {
    const FootPose& pose = feet.foot[side];
    Stance& foot = out.foot[side];
    Foot& state = feet_[side];
    foot.ends = std::exchange(state.leaves, false);
    // It came down at some time since the sample before the one that shows it.
    if (!state.weights) state.touchdown = contacts.since[side];
    const double phase = to_seconds(feet.t - state.touchdown) + out.dt;
    const double rolling = std::max(rolling_speed, rolling_share * contacts.sole_speed);
    const auto weights = share_of_corners(pose, x, omega, rolling);
    if (stuck(side, feet, omega) || !carries[side]) {
      foot.ends = foot.ends || state.weights.has_value();
      state.weights.reset();
      noise_.interrupt(side);
      continue;
    }
    foot.begins = !state.weights.has_value();
    foot.used = true;
    for (std::size_t k = 0; k < static_cast<std::size_t>(pose.corners); ++k) {
      foot.point.p += weights[k] * pose.p[k];
      foot.point.v += weights[k] * pose.v[k];
      if (!foot.begins) foot.shift += (weights[k] - (*state.weights)[k]) * pose.p[k];
    }
    state.weights = weights;
    if (foot.begins && has_heights_) add_ground(side, foot, x, support.map, contacts.normal, support.ground);
    // Eq. 8: a moving foot has a larger variance; so has one that has just touched down.
    const Eigen::Vector3d velocity = velocity_W(x, foot.point.p, foot.point.v, omega);
    if (foot.begins) state.sole_velocity = velocity;
    state.sole_velocity += std::min(1.0, 2 * out.dt / entry_time) * (velocity - state.sole_velocity);
    const double moving2 = state.sole_velocity.squaredNorm();
    if (phase > config_.entry_delay + entry_time)
      noise_.add(side, velocity, -x.g.normalized(), out.dt,
                 support.on_legs_alone ? std::optional(std::hypot(sigma_v, described_share * x.v.norm())) : std::nullopt);
    const double noise2 = out.velocity_sigma * out.velocity_sigma + sigma_v * sigma_v;
    const double entering = std::clamp(1.0 - (phase - config_.entry_delay) / entry_time, 0.0, 1.0);
    // What still slides as it comes down takes its contact position along. Later only an error of the state would seem to slide for long.
    if (entering > 0) foot.slide_variance = velocity.squaredNorm() * entry_time * out.dt;
    // As much as the noise across on all three axes is no motion.
    const double loose = 1.0 + (by_foot_ ? std::max(0.0, moving2 / noise2 - 3.0) : 0.0) + (largest_scale - 1) * entering;
    if (by_row_ && !foot.begins)
      foot.row_scale = scale_of_rows(velocity, noise2, foot_position(x, foot.point, x.pc[side] + x.R * foot.shift).r,
                                     room_to_settle * config_.position_sigma * config_.position_sigma);
    // Of two feet that stand, the lighter one counts less: a sole that carries little slides and rolls.
    const double lighter = carries[1 - side] ? std::max(1.0, contacts.load[1 - side] / contacts.load[side]) : 1.0;
    foot.variance_scale = std::min(lighter * loose / contacts.probability[side], largest_scale * largest_scale);
  }
  out.rise = noise_.take_rise();
  // Both soles three times as fast as one that swings: the state's velocity is wrong, for samples of the IMU that were.
  if (support.on_legs_alone && !contacts.flight && contacts.swing_speed > 0) {
    const Eigen::Vector3d left = slowest_of(feet.foot[0], x, omega), right = slowest_of(feet.foot[1], x, omega);
    const Eigen::Vector3d& slower = left.squaredNorm() < right.squaredNorm() ? left : right;
    if (slower.norm() > 3 * contacts.swing_speed) out.false_velocity = slower;
  }
  return out;
}

}  // namespace kilvo
