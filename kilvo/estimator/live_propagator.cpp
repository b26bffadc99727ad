#include "kilvo/estimator/live_propagator.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/estimator/fault.hpp"
#include "kilvo/estimator/leg_update.hpp"
#include "kilvo/estimator/recovery.hpp"
#include "kilvo/estimator/silence.hpp"
#include "kilvo/estimator/stopwatch.hpp"

namespace kilvo {

LivePropagator::LivePropagator(const Robot& robot, const EstimatorConfig& config)
    : leg_rate_(robot.legs.rate),
      imu_rate_(robot.imu.rate),
      replay_(config),
      contacts_(config.legs),
      stances_(config.legs),
      clipping_(robot.imu.gyro_range, robot.imu.accel_range) {}

// Both ends of the IMU's intervals up to the newest sample that is not after `until` are known now.
void LivePropagator::close(Time until) {
  const Time newest = replay_.newest_imu_by(until);
  if (newest <= closed_.t) return;
  replay_.close(closed_, now_, newest, nullptr);
  now_ = closed_;
  replay_.forget_before(closed_.t);
  // A sample of the IMU that came after leg samples of later stamps.
  if (last_legs_ && *last_legs_ > now_.t) replay_.advance(now_, *last_legs_, nullptr);
}

// The estimator will say so as well, once it has stopped waiting for them.
void LivePropagator::miss_legs() {
  last_legs_.reset();
  if (!has_legs(modality_)) return;
  modality_ = without_legs(modality_);
  cause_ = Reason::legs_lost;
}

// What is not finite goes nowhere: it is silent until the estimator, which throws such a state away, is forked again.
bool LivePropagator::keep_finite() {
  started_ = is_finite(now_);
  return started_;
}

bool LivePropagator::push(const ImuSample& raw) {
  if (!started_ || imu_lost_ || fault_of(raw)) return false;
  const Time newest = replay_.newest_imu().t;
  // Whether its clock has jumped or the IMU was silent is for the estimator to find out.
  if (raw.t <= newest || to_seconds(raw.t - newest) > blind_gap) return false;
  ImuSample s = raw;
  s.accel *= accel_scale_;
  clipping_.mark(s);
  replay_.add(s);
  if (last_legs_ && s.t - *last_legs_ - lag_ > silence_of_legs(leg_rate_)) miss_legs();
  if (last_legs_ && !are_legs_overdue(s.t - *last_legs_ - lag_, leg_rate_, leg_period_)) return false;
  close(s.t);
  with_legs_ = false;
  return keep_finite();
}

bool LivePropagator::push(const Feet& feet) {
  if (!started_ || imu_lost_) return false;
  if (!last_legs_ || feet.t <= *last_legs_ || feet.t < closed_.t) return false;
  if (to_seconds(feet.t - replay_.newest_imu().t) > longest_held_imu(imu_rate_)) return false;
  if (feet.t - *last_legs_ > silence_of_legs(leg_rate_)) {
    last_legs_.reset();  // they come again: how, the estimator decides
    return false;
  }
  Stopwatch watch;
  close(feet.t);
  if (feet.t < now_.t) return false;
  leg_period_ = std::min(0.1, to_seconds(feet.t - *last_legs_));
  last_legs_ = feet.t;
  replay_.predict_to(now_, feet.t, nullptr);
  // Without the map: it is the estimator's, and grows. What the ground tells is told by the next fork.
  contact_us_ = update_by_legs(feet, now_, contacts_, stances_, replay_, nullptr, StanceTracker::Ground::learn).contact_us;
  if (feet.t == closed_.t) closed_ = now_;
  with_legs_ = true;
  kinematic_us_ = watch.lap_us();
  return keep_finite();
}

Output LivePropagator::output() const {
  Output o;
  Estimate e = now_;
  if (imu_lost_) inflate_covariance_over_gap(e, e.t, e.t + from_seconds(blind_gap), blind_gap);
  o.t = e.t;
  o.epoch = epoch_;
  o.x = e.x;
  o.P = e.P;
  o.P.topLeftCorner<6, 6>() += map_error_;
  o.omega = replay_.newest_imu().gyro - now_.x.bg;
  o.modality = modality_;
  o.cause = cause_;
  if (with_legs_) {
    o.contacts = contacts_.contacts();
    o.kinematic_us = kinematic_us_;
    o.contact_us = contact_us_;
  }
  return o;
}

}  // namespace kilvo
