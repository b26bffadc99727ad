#include "kilvo/estimator/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kilvo/estimator/live_propagator.hpp"
#include "kilvo/filter/gap.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "kilvo/math/stopwatch.hpp"

namespace kilvo {

Estimator::Estimator(const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used)
    : config_(config),
      input_(robot, used, from_seconds(config.max_wait), config.wait_for_images),
      starter_(config),
      imu_(robot.imu, config.initial),
      history_(config),
      legs_(config.legs),
      lidar_(robot.lidar, config.lidar, config.update, config.threads),
      map_(config.map, config.lidar, robot.lidar.T_imu_lidar.p),
      frames_(robot.lidar.rate, input_.uses(Sensor::lidar)),
      status_(robot, config.settling != "none") {
  if (!input_.uses(Sensor::imu)) throw std::invalid_argument("the IMU is needed: nothing is estimated without it");
  if (config.lidar.voxel_size > map_.surfaces().leaf_size() * (1 + 1e-9))
    throw std::invalid_argument("lidar.voxel_size must be at most a quarter of map.voxel_size");
  if (input_.uses(Sensor::legs)) kinematics_ = std::make_unique<LegKinematics>(robot, legs_.needs_forces());
  if (input_.uses(Sensor::camera)) vision_.emplace(robot.camera, config.vision, config.visual_map, config.update, config.map.radius);
}

Estimator::Estimator(Estimator&&) noexcept = default;
Estimator& Estimator::operator=(Estimator&&) noexcept = default;
Estimator::~Estimator() = default;

std::optional<std::string> Estimator::mismatch(const JointSample& s) const { return kinematics_ ? kinematics_->mismatch(s) : std::nullopt; }

std::vector<Output> Estimator::push(Measurement m) {
  std::vector<Output> out;
  push(std::move(m), out);
  return out;
}

void Estimator::push(Measurement m, std::vector<Output>& out) {
  input_.push(std::move(m));
  if (input_.clock_steps().count() > statistics().clock_steps) findings_.report_clock_steps(situation(), input_.clock_steps());
  if (input_.time_went_back()) {
    // Another recording, or the same again. What waited belongs to the time before; nothing else is kept.
    finish(out);
    InputQueue input = input_.next_epoch();
    Estimator fresh(input.robot(), config_, input.used());
    fresh.input_ = std::move(input);
    fresh.findings_ = findings_.next_epoch();
    if (map_.is_given()) fresh.give_map(map_.take());
    *this = std::move(fresh);
    findings_.report(situation(), {}, Reason::began_anew, to_seconds(input_.clock_steps().last()));
  }
  if (input_.health().imu_silence() > blind_gap) lose_imu(out);
  for (const auto& [sensor, reason] : input_.take_refused()) findings_.drop(sensor, reason);
  while (auto next = input_.pop()) handle(std::move(*next), out);
}

std::vector<Output> Estimator::finish() {
  std::vector<Output> out;
  finish(out);
  return out;
}

void Estimator::handle(Measurement m, std::vector<Output>& out) {
  if (!history_.has_begun()) {
    const auto start = starter_.add(std::move(m));
    for (const Sensor s : starter_.take_dropped()) findings_.drop(s, Reason::before_start);
    if (start) begin(*start, out);
    return;
  }
  const auto* image = std::get_if<CameraImage>(&m);
  if (const auto fault = image == nullptr ? std::nullopt : vision_->fault_of(*image)) {
    if (!fault->detail.empty()) findings_.report(situation(), Sensor::camera, Reason::foreign_images, 0, fault->detail);
    return findings_.drop(Sensor::camera, fault->reason);
  }
  const auto take = [&](auto& what) {
    if constexpr (requires { process(what, out); }) {
      process(what, out);
    } else if (const auto crowded_out = frames_.push(std::move(what))) {
      findings_.drop(crowded_out->sensor(), Reason::no_imu);
    }
  };
  std::visit(take, m);
}

void Estimator::begin(const Start& start, std::vector<Output>& out) {
  const Time t = start.estimate.t;
  imu_.set_scale(start.accel_scale);
  // Sweeps see for themselves how a robot settles while it stands.
  history_.begin(start.estimate, input_.uses(Sensor::lidar) ? std::nullopt : start.rest_until);
  status_.begin(t, input_.used());
  // While the robot moves the first sweeps measure the velocity; the legs measure it within a step.
  constexpr Duration a_step = std::chrono::seconds(1);
  if (vision_) vision_->begin_at(start.still ? t : t + longest_moving_start);
  lidar_.begin_at(start.still || !input_.uses(Sensor::legs) ? t : t + a_step, start.estimate.x.pose());
  if (!start.still && input_.uses(Sensor::lidar) && !map_.is_given()) moving_start_.emplace(input_.robot().lidar, config_, start.estimate);
  if (!start.still) findings_.report(situation(), {}, Reason::moving_start);
  const double norm = start.resting_norm * start.accel_scale;
  if (std::abs(norm - standard_gravity) > 0.1 * standard_gravity)
    findings_.report(situation(), Sensor::imu, Reason::strange_gravity, start.resting_norm);
  // Since the robot stood still, what came during the window is as good as what comes now.
  for (Measurement& m : starter_.take_kept()) {
    if (completion_of(m) < t) {
      findings_.drop(sensor_of(m), Reason::before_start);
    } else {
      handle(std::move(m), out);
    }
  }
}

void Estimator::finish(std::vector<Output>& out) {
  input_.end();
  frames_.end();
  for (const auto& [sensor, reason] : input_.take_refused()) findings_.drop(sensor, reason);
  while (auto next = input_.pop()) handle(std::move(*next), out);
  // A scan that ends between the last IMU sample and where the next would have been: the last sample is held.
  const Duration period = from_seconds(1.5 / input_.robot().imu.rate);
  if (history_.has_begun() && history_.replay().has_imu() && frames_.has_one_until(history_.replay().newest_imu().t + period)) {
    ImuSample held = history_.replay().newest_imu();
    held.t = std::max(held.t, frames_.first_end());
    if (held.t > history_.replay().newest_imu().t) history_.add(held);
    while (auto frame = frames_.pop(held.t)) std::visit([&](const auto& what) { process(what, *frame, out); }, frame->what);
    if (outputs_.has_sweep() && history_.now().t < held.t) history_.advance_to(held.t);
  }
  while (!outputs_.empty()) {
    // Each has a time of its own, after what has gone out already.
    if (outputs_.last()) history_.advance_to(std::max(history_.now().t, *outputs_.last() + Duration(1000)));
    emit(history_.now(), out);
  }
  for (const FrameQueue::Frame& f : frames_.take_rest()) findings_.drop(f.sensor(), Reason::no_imu);
  for (const Measurement& m : starter_.take_kept()) findings_.drop(sensor_of(m), Reason::before_start);
  findings_.finish(situation());
}

void Estimator::process(ImuSample s, std::vector<Output>& out) {
  if (const auto fault = imu_.prepare(s)) return findings_.drop(Sensor::imu, *fault);
  if (s.gyro_clipped || s.accel_clipped) findings_.report_clipping(situation(), s, input_.health().count_clipped());
  findings_.use(Sensor::imu);
  // Where the IMU was silent as well, it is not known whether the legs are lost.
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
  if (was_blind) findings_.report_gap(situation(), to_seconds(s.t - heard));
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

void Estimator::choose_modality(Time t) {
  const SensorStatus::Change change = status_.choose(t, input_.health());
  if (change == SensorStatus::Change::none) return;
  findings_.report(situation(), {}, status_.cause());
  // A failed sensor may have been wrong before the failure was detected, m/s.
  constexpr double doubt = 0.003;
  if (change == SensorStatus::Change::of_modality && status_.modality() == Modality::coast && frames_.empty())
    history_.inflate_velocity(doubt);
}

bool Estimator::keep_plausible(bool definite) {
  if (is_plausible(history_.now()) && (!definite || is_definite(history_.now().P))) return true;
  const double lost = history_.roll_back();
  legs_.restart();
  ++findings_.statistics().rollbacks;
  findings_.report(situation(), {}, Reason::state_thrown_away, lost);
  return false;
}

Findings::Situation Estimator::situation() const {
  const Time t = history_.has_begun() ? history_.now().t : input_.health().heard(Sensor::imu).value_or(Time{});
  return {t,
          history_.now(),
          input_.health(),
          status_.modality(),
          history_.replay().accel_noise(),
          config_.noise.accel,
          status_.has_legs(),
          legs_.last_used_stance(),
          legs_.leg_length()};
}

PoseCovariance Estimator::common_error(const State& x) const {
  const PoseCovariance error = map_.error_at(x.pose()) + lidar_.mount_error_at(x.pose()) + legs_.description_error(x);
  return moving_start_ ? PoseCovariance(error + moving_start_->error_at(x.pose())) : error;
}

void Estimator::emit(const Estimate& e, std::vector<Output>& out, std::optional<Contacts> contacts, double kinematic_us,
                     double contact_us) {
  Output* const o = outputs_.next(e.t, out);
  if (o == nullptr) return;
  o->epoch = epoch();
  o->x = e.x;
  o->P = e.P;
  o->P.topLeftCorner<6, 6>() += common_error(e.x);
  if (history_.replay().has_imu()) o->omega = history_.replay().newest_imu().gyro - e.x.bg;
  o->modality = status_.modality();
  o->cause = status_.cause();
  if (findings_.has_news()) o->events = findings_.take_events();
  o->contacts = contacts;
  o->vertical_W = legs_.vertical();
  o->kinematic_us = kinematic_us;
  o->contact_us = contact_us;
}

bool Estimator::fork(LivePropagator& into) const {
  if (!history_.has_begun() || !history_.replay().has_imu()) return false;
  into.become(history_, legs_, imu_, status_, common_error(history_.now().x), epoch());
  return true;
}

}  // namespace kilvo
