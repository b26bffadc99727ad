// The asynchronous phase: IMU and legs.
#include <algorithm>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/estimator/stopwatch.hpp"

namespace kilvo {
namespace {

// Without sweeps nothing older than this will be replayed.
constexpr Duration longest_replay = std::chrono::seconds(2);

// theta_s of Eq. 16: a sensor that has been silent for longer is lost.
Duration silence(double rate, double periods, Duration least) { return std::max(least, from_seconds(periods / rate)); }

}  // namespace

void Estimator::choose_modality(Time t) {
  const bool lidar = uses(Sensor::lidar) && t - last_sweep_ <= silence(robot_.lidar.rate, 3, std::chrono::milliseconds(300));
  const bool legs = last_legs_.has_value();
  const Modality now = legs ? (lidar ? Modality::kil : Modality::ki) : (lidar ? Modality::li : Modality::coast);
  if (now == modality_) return;
  const bool had_lidar = modality_ == Modality::kil || modality_ == Modality::li;
  const bool had_legs = modality_ == Modality::kil || modality_ == Modality::ki;
  if (modality_ != Modality::coast || cause_ != std::string_view("start"))
    cause_ = lidar != had_lidar ? (lidar ? "lidar is back" : "lidar lost") : (legs && !had_legs ? "legs are back" : "legs lost");
  modality_ = now;
}

void Estimator::handle_imu(ImuSample s, std::vector<Output>& out) {
  s.accel *= accel_scale_;
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::imu)].used;
  replay_.add(s);
  if (s.t < closed_.t) return;
  if (last_legs_ && s.t - *last_legs_ > silence(robot_.legs.rate, 5, std::chrono::milliseconds(50))) lose_legs(s.t);
  if (!pending_.empty() && pending_.front().end <= s.t) {
    process_pending(s.t, out);
    closed_ = *estimate_;
  }
  replay_.advance(closed_, s.t, trajectory_);
  estimate_ = closed_;
  keep_finite();
  if (s.t - anchor_.t > longest_replay && pending_.empty()) settle(closed_);
  choose_modality(s.t);
  if (!last_legs_) emit(out);
}

void Estimator::lose_legs(Time t) {
  LegStep step;
  step.t = std::max(t, estimate_->t);
  for (Stance& foot : step.foot) foot.ends = true;
  replay_.add(step);
  for (Estimate* e : {&*estimate_, &closed_}) {
    for (std::size_t side = 0; side < 2; ++side) end_stance(*e, side);
  }
  stances_.restart();
  contacts_.restart();
  last_legs_.reset();
}

void Estimator::handle_legs(const JointSample& s, std::vector<Output>& out) {
  Stopwatch watch;
  if (s.t < estimate_->t || !replay_.has_imu()) return drop(Sensor::legs, "before the state");
  auto known = kinematics_->feet(s);
  if (const auto* fault = std::get_if<std::string>(&known)) return drop(Sensor::legs, *fault);
  const Feet& feet = std::get<Feet>(known);
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::legs)].used;
  last_legs_ = s.t;

  replay_.predict_to(*estimate_, s.t, nullptr);
  const State& x = estimate_->x;
  const Eigen::Vector3d omega = replay_.newest_imu().gyro - x.bg;
  const double before_us = watch.lap_us();
  const Contacts& contacts = contacts_.update(feet, x, omega, replay_.newest_imu().accel - x.ba);
  const double contact_us = watch.lap_us();
  const LegStep step = stances_.step(feet, contacts_, x, omega);
  replay_.add(step);
  replay_.apply(*estimate_, step);
  keep_finite();
  // A sample of the IMU's own time belongs before the interval that begins there.
  if (s.t == anchor_.t) anchor_ = *estimate_;
  if (s.t == closed_.t) closed_ = *estimate_;
  const double after_us = watch.lap_us();

  choose_modality(s.t);
  emit(out, contacts, before_us + contact_us + after_us, contact_us);
}

}  // namespace kilvo
