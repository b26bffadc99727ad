// The asynchronous phase: IMU and legs.
#include <algorithm>
#include <cmath>
#include <utility>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/estimator/leg_update.hpp"
#include "kilvo/estimator/silence.hpp"
#include "kilvo/estimator/stopwatch.hpp"

namespace kilvo {
namespace {

// Without sweeps nothing older than this will be replayed.
constexpr Duration longest_replay = std::chrono::seconds(2);
// No robot is hit so hard, and no IMU for robots measures it, m/s^2.
constexpr double absurd_accel = 1000;

}  // namespace

void Estimator::handle_imu(ImuSample s, std::vector<Output>& out) {
  s.accel *= accel_scale_;
  if (s.accel.norm() > absurd_accel) return drop(Sensor::imu, Reason::absurd_value);
  note_clipping(s);
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::imu)].used;
  // Where the IMU was silent as well, nobody can say that the legs are lost.
  const Time heard = replay_.has_imu() ? replay_.newest_imu().t : s.t;
  if (to_seconds(s.t - heard) > blind_gap) bridge(heard, out);
  recovery_.imu_lost = false;
  replay_.add(s);
  stationarity_.add(s);
  if (s.t < closed_.t) return;
  if (last_legs_ && health_.is_frozen(Sensor::legs)) lose_legs(s.t);
  if (last_legs_ && heard - *last_legs_ > silence_of_legs(robot_.legs.rate)) lose_legs(s.t);
  if (!pending_.empty() && pending_.front().end <= s.t) {
    estimate_ = closed_;  // should all of it wait, or be dropped
    process_pending(s.t, out);
    closed_ = *estimate_;
  }
  Stopwatch watch;
  replay_.remember(closed_);
  replay_.close(closed_, *estimate_, s.t, &trajectory_);
  estimate_ = closed_;
  closing_us_ = last_legs_ ? closing_us_ + watch.lap_us() : 0;
  if (keep_finite()) good_ = closed_;
  if (s.t - anchor_.t > longest_replay && pending_.empty()) rebase(closed_);
  choose_modality(s.t);
  look_at_streams(s.t);
  zero_velocity_update(s);
  if (!last_legs_ || are_legs_overdue(s.t - *last_legs_, robot_.legs.rate, leg_period_)) emit(out);
}

// On the legs alone one foot carries unless the IMU measures a flight; a long one is none.
void Estimator::keep_a_stance(const LegStep& step) {
  const bool carried = step.foot[0].used || step.foot[1].used;
  if (carried) last_used_stance_ = step.t;
  if (carried || modality_ != Modality::ki) last_stance_ = step.t;
  if (step.t - last_stance_ < longest_flight) return;
  contacts_.restart();
  stances_.restart();
  last_stance_ = step.t;
  ++statistics_.lost_stances;
}

void Estimator::handle_legs(const JointSample& s, std::vector<Output>& out) {
  Stopwatch watch;
  if (s.t < estimate_->t || !replay_.has_imu()) return drop(Sensor::legs, Reason::before_state);
  if (to_seconds(s.t - replay_.newest_imu().t) > longest_held_imu(robot_.imu.rate)) return drop(Sensor::legs, Reason::no_imu);
  if (recovery_.imu_lost) return drop(Sensor::legs, Reason::no_imu);
  if (!legs_may_return(s.t)) return drop(Sensor::legs, Reason::not_calm);
  auto known = kinematics_->feet(s);
  if (const auto* fault = std::get_if<std::string>(&known)) return drop(Sensor::legs, Reason::wrong_joints, *fault);
  const Feet& feet = std::get<Feet>(known);
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::legs)].used;
  leg_length_ = std::max(leg_length_, feet.foot[0].p[0].norm());
  if (last_legs_) leg_period_ = std::min(0.1, to_seconds(s.t - *last_legs_));
  last_legs_ = s.t;

  replay_.predict_to(*estimate_, s.t, nullptr);
  // Beside a LiDAR the ground under a foot tells nothing new of the height, but how the feet stand on it.
  const auto ground = modality_ == Modality::ki ? StanceTracker::Ground::use : StanceTracker::Ground::learn;
  const auto [step, passed, contact_us] = update_by_legs(feet, *estimate_, contacts_, stances_, replay_, &map_, ground);
  if (!passed[0] && !passed[1]) ++statistics_.unsupported;
  keep_finite();
  // A sample of the IMU's own time belongs before the interval that begins there.
  if (s.t == anchor_.t) anchor_ = *estimate_;
  if (s.t == closed_.t) closed_ = *estimate_;
  const double kinematic_us = watch.lap_us();

  choose_modality(s.t);
  keep_a_stance(step);
  emit(out, contacts_.contacts(), kinematic_us + std::exchange(closing_us_, 0), contact_us);
}

}  // namespace kilvo
