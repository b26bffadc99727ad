#include "kilvo/legs/contact_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kilvo {
namespace {

using std::chrono::milliseconds;

// A person, a G1 and an iCub walk at about this Froude speed, sqrt(g l): the first guess, until a swing has been seen.
constexpr double froude_share = 0.4;
// How much a new swing counts.
constexpr double swing_gain = 0.3;
// A velocity known to this is taken as known, m/s.
constexpr double known_velocity = 0.02;
// At the start nothing is known of the feet of a robot whose velocity is less known than this, m/s. One that stands shows the same velocity
// for so long, but for this, m/s; another that stands as well shows the same as well. After a while the level must do.
constexpr double unknown_velocity = 0.15;
constexpr Duration steady_window = milliseconds(80), longest_search = milliseconds(1000);
constexpr double steady = 0.08, alike = 0.1, at_rest = 0.05;
// At the start both feet stand that are at one level, as a share of the height of the IMU over them.
constexpr double standing_level = 0.025;
// A swing shorter than this, or slower than a third of the usual, teaches nothing; but several slow ones in a row are how it walks now.
constexpr Duration shortest_swing = milliseconds(120);
constexpr double slowest_swing = 0.3;
constexpr int patience = 4;
// While it settles, a foot must be faster than this share to be lifted: soft ground bounces.
constexpr double settling_factor = 7;
// A cue must last so long. At low rates so many samples.
constexpr Duration lift_frames = milliseconds(2), impact_frames = milliseconds(1), slow_frames = milliseconds(4);
// How far back descent and speed before an impact are looked for.
constexpr Duration impact_window = milliseconds(20), descent_window = milliseconds(80);
// An impact begins at this share of the swing speed at least; a descent is faster than this.
constexpr double impact_speed = 0.4, descent_speed = 0.1;
// An impact has taken this much of the downward speed.
constexpr double impact_rest = 0.7;
// Without any descent: still for so long.
constexpr Duration still_frames = milliseconds(200);
constexpr double detection_threshold = 10;  // theta_d
constexpr double statistics_time = 2.0;     // s

double leg_length(const Feet& feet, const State& x) {
  return std::max(std::abs((x.R * feet.foot[0].p[0]).z()), std::abs((x.R * feet.foot[1].p[0]).z()));
}

}  // namespace

FootMotion motion_of(const FootPose& foot, const State& x, const Eigen::Vector3d& omega, double sigma_v) {
  const Eigen::Vector3d up_W = -x.g.normalized();
  FootMotion out;
  out.slowest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < foot.corners; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.slowest = std::min(out.slowest, velocity_W(x, foot.p[k], foot.v[k], omega).squaredNorm());
  }
  out.slowest = std::max(0.0, std::sqrt(out.slowest) - 2 * std::max(0.0, sigma_v - known_velocity));
  const SolePoint low = lowest_point(foot, x.R.matrix().transpose() * up_W);
  const Eigen::Vector3d v_W = velocity_W(x, low.p, low.v, omega);
  out.velocity = v_W;
  out.speed = v_W.norm();
  out.vertical = up_W.dot(v_W);
  out.lowest = x.pose() * low.p;
  out.height = up_W.dot(out.lowest);
  return out;
}

// The foot that is clearly higher than the other is in the air, or will show that it is not.
void ContactEstimator::guess_standing(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion) {
  for (std::size_t side = 0; side < 2; ++side)
    contacts_.on[side] = motion[side].height - motion[1 - side].height < standing_level * leg_length(feet, x);
}

void ContactEstimator::start(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion) {
  const double leg = leg_length(feet, x);
  if (swing_speed_ == 0) swing_speed_ = first_guess_ = froude_share * std::sqrt(standard_gravity * std::max(leg, 0.1));
  for (std::size_t side = 0; side < 2; ++side) {
    FootState& f = foot_[side];
    f = {};
    f.since = feet.t - milliseconds(1000);
    f.ground = {-x.g.normalized(), motion[side].lowest, 0};
    contacts_.since[side] = f.since;
  }
  guess_standing(feet, x, motion);
  ground_.forget();
  started_ = true;
}

// How much the velocity of a foot has varied lately, m/s; infinite when it has not been looked at for long enough.
double ContactEstimator::unsteadiness(const FootState& f, Time t) const {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t back = 0; back < std::min(f.count, history); ++back) {
    const Sample& s = f.samples[(f.count - 1 - back) % history];
    low = low.cwiseMin(s.velocity);
    high = high.cwiseMax(s.velocity);
    if (t - s.t >= steady_window) return (high - low).norm();
  }
  return std::numeric_limits<double>::infinity();
}

// Whatever the velocity of the body is: the IMU tells how it changes, so that a foot that stands seems to move by what stays the same.
// Two feet that do not move against each other both stand.
bool ContactEstimator::find_standing(Time t) {
  const std::array<double, 2> varied = {unsteadiness(foot_[0], t), unsteadiness(foot_[1], t)};
  const std::size_t best = varied[0] <= varied[1] ? 0 : 1;
  const auto newest = [this](std::size_t side) { return foot_[side].samples[(foot_[side].count - 1) % history].velocity; };
  if ((newest(0) - newest(1)).norm() < at_rest) {
    contacts_.on = {true, true};
    return true;
  }
  if (varied[best] > steady) return false;
  contacts_.on[best] = true;
  contacts_.on[1 - best] = varied[1 - best] <= steady && (newest(0) - newest(1)).norm() < alike;
  return true;
}

void ContactEstimator::search(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion) {
  contacts_.on = {false, false};
  const bool found = find_standing(feet.t);
  if (!found && feet.t - *searching_ < longest_search) return;
  if (!found) guess_standing(feet, x, motion);
  searching_.reset();
  // What was seen until now was relative to an unknown velocity.
  for (FootState& f : foot_) {
    f.count = 0;
    f.peak = 0;
  }
}

// True once the cue has been there in every sample for `at_least`, and for three samples.
bool ContactEstimator::held(std::optional<Time>& since, bool cue, Time t, Duration at_least) const {
  if (!cue) {
    since.reset();
    return false;
  }
  if (!since) since = t;
  return t - *since >= at_least;
}

bool ContactEstimator::lifts(FootState& f, const FootMotion& m, Time t) const {
  const bool settling = to_seconds(t - f.since) < config_.settling;
  const double speed = config_.lift_off_speed * swing_speed_ * (settling ? settling_factor : 1.0);
  return held(f.moving, m.slowest > speed, t, std::max(lift_frames, 2 * period_));
}

bool ContactEstimator::lands(FootState& f, const FootMotion& m, Time t) const {
  double fastest = 0, down_now = 0, down = 0;
  for (std::size_t back = 0; back < std::min(f.count, history); ++back) {
    const Sample& s = f.samples[(f.count - 1 - back) % history];
    if (t - s.t > descent_window) break;
    down = std::min(down, s.vertical);
    if (t - s.t > impact_window) continue;
    fastest = std::max(fastest, s.speed);
    down_now = std::min(down_now, s.vertical);
  }
  const double S = swing_speed_;
  const bool impact = m.speed < config_.impact_drop * fastest && fastest > impact_speed * S && down_now < -descent_speed * S &&
                      m.vertical > impact_rest * down_now;
  const bool slow = m.slowest < config_.touchdown_speed * S;
  if (held(f.impact, impact, t, std::min(impact_frames, period_))) return true;
  const bool slow_long = held(f.slow, slow, t, std::max(slow_frames, 2 * period_));
  if (slow_long && down < -descent_speed * S) return true;
  return slow_long && t - *f.slow >= still_frames;
}

void ContactEstimator::learn(double peak, Duration swing) {
  if (swing <= shortest_swing) return;
  slow_swings_ = peak > slowest_swing * swing_speed_ ? 0 : slow_swings_ + 1;
  const bool walks_so = slow_swings_ > patience && peak > slowest_swing * first_guess_;
  if (slow_swings_ == 0 || walks_so) swing_speed_ += swing_gain * (peak - swing_speed_);
}

// The ground is looked up at touchdown; through the point on which the foot stands, so that standing has no clearance.
void ContactEstimator::stand(FootState& f, const FootMotion& m, const State& x, bool arrives, const VoxelMap* map) {
  if (arrives) {
    ground_.stands_at(m.lowest);
    if (const auto patch = ground_.under(map, m.lowest, -x.g.normalized())) f.ground.normal = patch->normal;
  }
  f.ground.point = m.lowest;
}

// Deviation of the acceleration from its usual values of the last seconds, in their standard deviations.
void ContactEstimator::deviate(const Eigen::Vector3d& accel, double dt) {
  constexpr double least_variance = 1e-4;  // (m/s^2)^2
  const double share = std::clamp(dt / statistics_time, 0.0, 1.0);
  if (accel_mean_.isZero(0)) accel_mean_ = accel;
  const Eigen::Vector3d off = accel - accel_mean_;
  contacts_.d_a = (off.array().abs() / (accel_variance_.array() + least_variance).sqrt()).sum();
  accel_mean_ += share * off;
  accel_variance_ += share * (off.cwiseAbs2() - accel_variance_);
}

const Contacts& ContactEstimator::update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel,
                                         double sigma_v, const VoxelMap* map) {
  const std::array<FootMotion, 2> motion = {motion_of(feet.foot[0], x, omega, sigma_v), motion_of(feet.foot[1], x, omega, sigma_v)};
  if (!started_) {
    contacts_.t = feet.t;
    start(feet, x, motion);
    searching_.reset();
    if (sigma_v > unknown_velocity) searching_ = feet.t;
  }
  period_ = std::clamp(feet.t - contacts_.t, Duration(0), Duration(milliseconds(20)));
  deviate(accel, to_seconds(period_));
  contacts_.t = feet.t;
  for (std::size_t side = 0; side < 2; ++side) {
    FootState& f = foot_[side];
    const FootMotion& m = motion[side];
    // One wild sample is no peak.
    if (f.count > 0) f.peak = std::max(f.peak, std::min(m.speed, f.samples[(f.count - 1) % history].speed));
    f.samples[f.count++ % history] = {feet.t, m.speed, m.vertical, m.velocity};
    if (searching_) continue;
    const bool stood = contacts_.on[side];
    if (contacts_.on[side] && lifts(f, m, feet.t)) {
      contacts_.on[side] = false;
      f.since = feet.t;
      f.peak = 0;
      f.moving.reset();
    } else if (!contacts_.on[side] && lands(f, m, feet.t)) {
      learn(f.peak, feet.t - f.since);
      contacts_.on[side] = true;
      f.since = feet.t;
      f.impact.reset();
      f.slow.reset();
    }
    if (contacts_.on[side]) stand(f, m, x, !stood, map);
    contacts_.since[side] = f.since;
    contacts_.ground[side] = f.ground;
    contacts_.clearance[side] = f.ground.height_of(m.lowest);
    contacts_.d_fv[side] = detection_threshold * m.slowest / (config_.lift_off_speed * swing_speed_);
  }
  if (searching_) search(feet, x, motion);
  return contacts_;
}

}  // namespace kilvo
