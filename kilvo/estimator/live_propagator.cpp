#include "kilvo/estimator/live_propagator.hpp"

#include "kilvo/filter/gap.hpp"
#include "kilvo/input/health.hpp"
#include "kilvo/math/stopwatch.hpp"

namespace kilvo {

LivePropagator::LivePropagator(const Robot& robot, const EstimatorConfig& config)
    : history_(config), legs_(config.legs), imu_(robot.imu, config.initial), status_(robot) {}

void LivePropagator::become(const History& history, const LegPipeline& legs, const ImuWatch& imu, const SensorStatus& status,
                            const PoseCovariance& common_error, std::uint32_t epoch) {
  history_.fork_from(history);
  legs_ = legs;
  imu_ = imu;
  status_ = status;
  common_error_ = common_error;
  epoch_ = epoch;
  started_ = true;
  with_legs_ = false;
}

// What is not finite goes nowhere: it is silent until the estimator, which throws such a state away, is forked again.
bool LivePropagator::keep_finite() {
  started_ = is_finite(history_.now());
  return started_;
}

bool LivePropagator::push(const ImuSample& raw) {
  if (!started_ || imu_lost() || fault_of(raw)) return false;
  const Time newest = history_.replay().newest_imu().t;
  // Whether its clock has jumped or the IMU was silent is for the estimator to find out.
  if (raw.t <= newest || to_seconds(raw.t - newest) > blind_gap) return false;
  ImuSample s = raw;
  if (imu_.prepare(s)) return false;
  history_.add(s);
  // The estimator will report it as well, once it has stopped waiting for them.
  if (status_.has_legs() && status_.are_legs_silent(s.t - *status_.last_used(Sensor::legs) - lag_)) status_.miss_legs();
  if (status_.has_legs() && !status_.are_legs_overdue(s.t - lag_)) return false;
  history_.close_fork(s.t, status_.last_used(Sensor::legs));
  with_legs_ = false;
  return keep_finite();
}

bool LivePropagator::push(const Feet& feet) {
  if (!started_ || imu_lost()) return false;
  if (!status_.has_legs() || feet.t <= *status_.last_used(Sensor::legs) || feet.t < known()) return false;
  if (status_.is_imu_missing(feet.t - history_.replay().newest_imu().t)) return false;
  if (status_.are_legs_silent(feet.t - *status_.last_used(Sensor::legs))) {
    status_.lose_legs();  // they come again: how, the estimator decides
    return false;
  }
  Stopwatch watch;
  history_.close_fork(feet.t, status_.last_used(Sensor::legs));
  if (feet.t < history_.now().t) return false;
  status_.use(Sensor::legs, feet.t);
  history_.predict_to(feet.t);
  // Without the map, which only the estimator has. The next fork carries the measurement of the ground.
  const auto [step, contact_us] =
      legs_.measure(feet, history_.now(), history_.replay().imu_at(feet.t), nullptr, StanceTracker::Ground::learn);
  legs_.judge(step, history_.take(step));
  history_.settle_leg_update();
  contact_us_ = contact_us;
  with_legs_ = true;
  kinematic_us_ = watch.lap_us();
  return keep_finite();
}

Output LivePropagator::output() const {
  Output o;
  Estimate e = history_.now();
  if (imu_lost()) inflate_covariance_over_gap(e, e.t, e.t + from_seconds(blind_gap), blind_gap);
  o.t = e.t;
  o.epoch = epoch_;
  o.x = e.x;
  o.P = e.P;
  o.P.topLeftCorner<6, 6>() += common_error_;
  o.omega = history_.replay().newest_imu().gyro - e.x.bg;
  o.modality = status_.modality();
  o.cause = status_.cause();
  o.vertical_W = legs_.vertical();
  if (with_legs_) {
    o.contacts = legs_.contacts();
    o.kinematic_us = kinematic_us_;
    o.contact_us = contact_us_;
  }
  return o;
}

}  // namespace kilvo
