// The asynchronous phase: IMU and legs go into the history as they come.
#include <algorithm>
#include <cmath>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/filter/gap.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "kilvo/math/stopwatch.hpp"

namespace kilvo {

void Estimator::process(ImuSample s, std::vector<Output>& out) {
  if (const auto fault = imu_.prepare(s)) return findings_.drop(Sensor::imu, *fault);
  if (s.gyro_clipped || s.accel_clipped) findings_.report_clipping(situation(), s, input_.health().count_clipped());
  findings_.use(Sensor::imu);
  // Where the IMU was silent as well, nobody can say that the legs are lost.
  const Time heard = history_.replay().has_imu() ? history_.replay().newest_imu().t : s.t;
  const bool was_blind = to_seconds(s.t - heard) > blind_gap;
  if (was_blind) {
    lose_imu(out);
    lidar_.rejoin();
    imu_.restart();
  }
  // Feet may have been lifted and set down in a gap; the velocity is anything that a walking robot's may be.
  if ((was_blind && status_.has_legs()) || (s.t >= history_.closed().t && status_.are_legs_lost(heard, input_.health()))) {
    history_.end_stances(was_blind ? heard : s.t);
    legs_.restart();
    status_.lose_legs();
  }
  status_.imu_is_back();
  history_.add(s);
  imu_.add(s, history_.now().x.bg);
  if (s.t < history_.closed().t) return;
  if (frames_.has_one_until(s.t)) {
    history_.drop_leg_updates_ahead();
    while (auto frame = frames_.pop(s.t)) std::visit([&](const auto& what) { process(what, *frame, out); }, frame->what);
    history_.resume(history_.now());
  }
  history_.close(s.t);
  if (!status_.has_legs()) history_.take_closing_us();
  if (keep_plausible()) history_.remember_good();
  if (s.t - history_.base().t > longest_wait && frames_.empty()) history_.rebase_to_closed();
  choose_modality(s.t);
  findings_.look(s.t, situation());
  if (status_.modality() == Modality::coast && frames_.empty()) {
    if (const auto standing = imu_.zero_velocity_update(history_.closed(), s, config_.update)) {
      history_.resume(*standing);
      if (keep_plausible()) history_.rebase_to_closed();
    }
  }
  if (!status_.has_legs() || status_.are_legs_overdue(s.t)) emit(history_.now(), out);
}

void Estimator::process(const JointSample& s, std::vector<Output>& out) {
  Stopwatch watch;
  const Replay& replay = history_.replay();
  if (s.t < history_.now().t || !replay.has_imu()) return findings_.drop(Sensor::legs, Reason::before_state);
  if (status_.imu_lost() || status_.is_imu_missing(s.t - replay.newest_imu().t)) return findings_.drop(Sensor::legs, Reason::no_imu);
  const double sigma_v = std::sqrt(std::max(0.0, history_.now().P.block<3, 3>(at::v, at::v).trace() / 3));
  if (!status_.may_legs_return(s.t, imu_.is_calm(s.t), sigma_v < known_velocity, input_.health()))
    return findings_.drop(Sensor::legs, Reason::not_calm);
  auto known = kinematics_->feet(s);
  if (const auto* fault = std::get_if<std::string>(&known)) return findings_.drop(Sensor::legs, Reason::wrong_joints, *fault);
  const Feet& feet = std::get<Feet>(known);
  findings_.use(Sensor::legs);
  if (!status_.has_legs()) legs_.expect_a_stance_from(s.t);
  status_.use(Sensor::legs, s.t);

  history_.predict_to(s.t);
  const auto ground = row_of(status_.modality()).ground_is_measured ? StanceTracker::Ground::use : StanceTracker::Ground::learn;
  // The IMU sample is of the feet's own time: a late leg sample is older than the newest one.
  const auto [step, contact_us] = legs_.measure(feet, history_.now(), replay.imu_at(s.t), &map_.surfaces(), ground);
  const std::array<bool, 2> passed = history_.take(step);
  legs_.judge(step, passed);
  if (!passed[0] && !passed[1]) ++findings_.statistics().unsupported;
  keep_plausible();
  history_.settle_leg_update();
  const double kinematic_us = watch.lap_us();

  choose_modality(s.t);
  if (legs_.has_lost_its_stance(step, status_.modality() == Modality::ki)) ++findings_.statistics().lost_stances;
  emit(history_.now(), out, legs_.contacts(), kinematic_us + history_.take_closing_us(), contact_us);
}

// Reported at once, after the last output; from then on there is no pose.
void Estimator::lose_imu(std::vector<Output>& out) {
  if (!history_.has_begun() || status_.imu_lost()) return;
  ++findings_.statistics().imu_outages;
  status_.lose_imu(input_.health());
  findings_.report(situation(), {}, status_.cause());
  Estimate e = history_.now();
  inflate_covariance_over_gap(e, e.t, e.t + from_seconds(blind_gap), blind_gap);
  e.t = std::max(e.t, outputs_.last().value_or(e.t) + Duration(1000));
  emit(e, out);
}

}  // namespace kilvo
