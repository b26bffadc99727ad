#include "lab/contacts/paper_contacts.hpp"

namespace kilvo::lab {
namespace {

using std::chrono::milliseconds;

// How long the still start is recorded for S_st.
constexpr Duration still_time = milliseconds(500);
// What lasted shorter or longer than this, or did not rise and come down more than the other foot, was no swing of a step: S_sw waits for
// the next one. The paper has no such bounds; without them a jolt of some milliseconds becomes the reference for good.
constexpr Duration shortest_swing = milliseconds(100), longest_swing = milliseconds(1000);
// Before the swing time is known.
constexpr Duration first_window = milliseconds(400);
// The "shorter slice" for the trend, as a share of the window.
constexpr int trend_share = 4;
// Encoders that resolve nothing smaller have no deviation of their own: m/s^2, m/s, and of the residual m/s or m.
constexpr double least_accel = 0.01, least_velocity = 1e-3, least_residual = 1e-4;
// Fewer contacts span no plane.
constexpr int contacts_of_a_patch = 3;

}  // namespace

bool HeldCue::update(bool on, Time t) {
  if (!on) {
    samples_ = 0;
    return false;
  }
  if (samples_ == 0) since_ = t;
  ++samples_;
  // N_d samples of 1 kHz span N_d - 1 frames; half a frame for stamps that jitter.
  return samples_ >= 3 && t - since_ >= milliseconds(PaperContactEstimator::N_d - 1) - std::chrono::microseconds(500);
}

// Delta t_sw, once it is known.
Duration PaperContactEstimator::window() const { return swing_time_.value_or(first_window); }

void PaperContactEstimator::start(const Feet& feet, const State& x, const std::array<FootMotionNow, 2>& motion) {
  contacts_.on = {true, true};
  contacts_.since = {feet.t, feet.t};
  still_since_ = feet.t;
  if (!static_known_) static_ = {};
  first_swing_.reset();
  impact_.reset();
  // The LiDAR does not see the ground at the feet yet: it is that of the two stance feet, level across (the anchor point).
  ground_.forget();
  touchdowns_ = 0;
  for (const FootMotionNow& m : motion) ground_.stands_at(m.lowest);
  const Eigen::Vector3d up_W = -x.g.normalized();
  const GroundPatch patch = ground_.of_contacts(up_W).value_or(GroundPatch{up_W, motion[0].lowest, 0});
  for (FootState& f : foot_) {
    f = {};
    f.ground = patch;
  }
  started_ = true;
}

// S_st; true while it is being recorded.
bool PaperContactEstimator::record_still_start(Time t, const Eigen::Vector3d& accel, const std::array<FootMotionNow, 2>& motion) {
  if (static_known_) return false;
  static_.accel.add(accel);
  for (const FootMotionNow& m : motion) static_.foot_velocity.add(m.velocity);
  static_known_ = t - still_since_ >= still_time;
  return true;
}

// Eq. 17: over the swing of one foot, of the acceleration and of the foot that supports meanwhile.
void PaperContactEstimator::record_first_swing(const Eigen::Vector3d& accel, const std::array<FootMotionNow, 2>& motion) {
  if (!first_swing_) return;
  learning_.accel.add(accel);
  learning_.foot_velocity.add(motion[1 - *first_swing_].velocity);
}

void PaperContactEstimator::learn(std::size_t side, const Residual& r) {
  if (first_swing_ && side == 1 - *first_swing_) learning_.residual.add(r);
}

PaperContactEstimator::Residual PaperContactEstimator::row_scale(const Residual& r) const {
  if (!swing_time_ || swing_.residual.count() == 0) return Residual::Ones();
  // As printed (d / max d) a row without deviation would have no noise at all, and the largest always alpha_s.
  return (swing_.residual.deviation(r, least_residual) / unusual_deviation).cwiseMax(1.0).cwiseMin(largest_scale);
}

void PaperContactEstimator::lift_off(std::size_t side, Time t) {
  FootState& f = foot_[side];
  f.was_fast = f.passed_peak = false;
  f.moving.reset();
  f.fast.reset();
  f.slow.reset();
  contacts_.on[side] = false;
  contacts_.since[side] = t;
  if (swing_time_) return;
  first_swing_ = side;
  learning_ = {};
}

// The ground is looked up at touchdown and used until the next one.
void PaperContactEstimator::touchdown(std::size_t side, Time t, const FootMotionNow& m, const State& x, const VoxelMap* map) {
  FootState& f = foot_[side];
  const Duration swing = t - contacts_.since[side];
  if (first_swing_ == side) {
    first_swing_.reset();
    if (swing >= shortest_swing && swing <= longest_swing && has_larger_area(side)) {
      swing_ = learning_;
      swing_time_ = swing;
    }
  }
  const Eigen::Vector3d up_W = -x.g.normalized();
  f.contact_patch.reset();
  if (touchdowns_ >= contacts_of_a_patch) f.contact_patch = ground_.of_contacts(up_W);
  ++touchdowns_;
  ground_.stands_at(m.lowest);
  if (const auto patch = ground_.under(map, m.lowest, up_W)) f.ground = *patch;
  f.clearances.clear();
  f.settled = false;
  f.calm.reset();
  f.moving.reset();
  contacts_.on[side] = true;
  contacts_.since[side] = t;
}

bool PaperContactEstimator::has_larger_area(std::size_t side) const {
  const auto own = foot_[side].clearances.area(window()), other = foot_[1 - side].clearances.area(window());
  return own && (!other || *own > *other);
}

// Of a foot in the air. `impact`: the acceleration's cue is active.
bool PaperContactEstimator::lands(std::size_t side, bool impact, double d_fv, Time t) {
  FootState& f = foot_[side];
  if (f.fast.update(d_fv > unusual_deviation, t)) f.was_fast = true;
  const bool slow = d_fv < unusual_deviation;
  if (f.was_fast && slow) f.passed_peak = true;
  const bool slow_long = f.slow.update(slow, t);
  if (!f.passed_peak) return false;
  if (impact && has_larger_area(side)) return true;
  if (!slow_long) return false;
  const auto trend = f.clearances.trend(window() / trend_share);
  return trend && *trend < 0;
}

const Contacts& PaperContactEstimator::update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel,
                                              double /*sigma_v*/, const VoxelMap* map) {
  const Eigen::Vector3d up_I = x.R.matrix().transpose() * -x.g.normalized();
  std::array<FootMotionNow, 2> motion;
  for (std::size_t side = 0; side < 2; ++side) {
    const SolePoint low = lowest_point(feet.foot[side], up_I);
    motion[side] = {velocity_W(x, low.p, low.v, omega), x.pose() * low.p};
  }
  contacts_.t = feet.t;
  contacts_.normal = -x.g.normalized();
  if (!started_) start(feet, x, motion);
  const bool still = record_still_start(feet.t, accel, motion);
  record_first_swing(accel, motion);

  const Reference& reference = swing_time_ ? swing_ : static_;
  contacts_.d_a = reference.accel.deviation(accel, least_accel).sum();  // Eq. 19
  const bool impact = impact_.update(contacts_.d_a > unusual_deviation, feet.t);
  for (std::size_t side = 0; side < 2; ++side) {
    FootState& f = foot_[side];
    const FootMotionNow& m = motion[side];
    const double d_fv = reference.foot_velocity.deviation(m.velocity, least_velocity).sum();
    contacts_.d_fv[side] = d_fv;
    f.clearances.add(feet.t, f.ground.height_of(m.lowest));  // Eq. 18
    contacts_.clearance[side] = f.ground.height_of(m.lowest);
    contacts_.ground[side] = f.ground;
    if (still) continue;
    if (contacts_.on[side]) {
      f.settled = f.settled || f.calm.update(contacts_.d_a < unusual_deviation, feet.t) || !swing_time_;
      // In the first step one foot supports: what it does meanwhile is S_sw.
      const bool may_lift = f.settled && (swing_time_ || contacts_.on[1 - side]);
      if (f.moving.update(d_fv > unusual_deviation, feet.t) && may_lift) lift_off(side, feet.t);
    } else if (lands(side, impact, d_fv, feet.t)) {
      touchdown(side, feet.t, m, x, map);
    }
    contacts_.ground[side] = f.ground;
  }
  for (std::size_t side = 0; side < 2; ++side) contacts_.probability[side] = contacts_.on[side] ? 1 : 0;
  return contacts_;
}

void PaperContactEstimator::adapt(LegStep& step, const State& x, const Eigen::Vector3d& gyro, const Height& height) {
  for (std::size_t side = 0; side < 2; ++side) {
    Stance& foot = step.foot[side];
    if (!foot.used || !contacts_.on[side]) continue;
    const Eigen::Vector3d pc = foot.begins ? x.pose() * foot.point.p : Eigen::Vector3d(x.pc[side] + x.R * foot.shift);
    Residual r;  // r_c of Eq. 7
    r << foot_velocity(x, foot.point, gyro).r, foot_position(x, foot.point, pc).r, foot_height(contacts_.ground[side], x, pc).r;
    learn(side, r);
    foot.row_scale = row_scale(r);
    foot.variance_scale = 1;
    const auto& patch = foot_[side].contact_patch;
    if (!foot.begins || foot.ground || !patch || !height.counts) continue;
    // Of a patch that the robot's own contacts span: it ties steps to each other, it is no absolute height, m.
    constexpr double contact_patch_sigma = 0.01;
    foot.ground = patch;
    foot.ground->sigma = std::hypot(std::max(patch->sigma, contact_patch_sigma), height.sigma);
  }
}

}  // namespace kilvo::lab
