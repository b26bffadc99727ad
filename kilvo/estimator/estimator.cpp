#include "kilvo/estimator/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kilvo/estimator/live_propagator.hpp"
#include "kilvo/estimator/silence.hpp"
#include "kilvo/filter/gap.hpp"
#include "kilvo/filter/plausible.hpp"
#include "kilvo/math/stopwatch.hpp"

namespace kilvo {
namespace {

// Without sweeps nothing older than this will be propagated again.
constexpr Duration longest_history = std::chrono::seconds(2);

std::vector<PointXYZI> in_world(const std::vector<PointXYZI>& points_I, const SE3& T_WI) {
  std::vector<PointXYZI> out(points_I.size());
  const Eigen::Matrix3f R = T_WI.R.matrix().cast<float>();
  const Eigen::Vector3f p = T_WI.p.cast<float>();
  for (std::size_t i = 0; i < points_I.size(); ++i) {
    out[i].head<3>() = R * points_I[i].head<3>() + p;
    out[i][3] = points_I[i][3];
  }
  return out;
}

// Offsets of a clock below these are of no consequence, or a model's error; once there is one, it is found as exactly as the data allows, s.
double least_offset(bool is_shifted) { return is_shifted ? 5e-4 : 2e-3; }

}  // namespace

Estimator::Estimator(const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used)
    : robot_(robot),
      config_(config),
      input_(robot, used, from_seconds(config.max_wait), config.wait_for_images),
      starter_(config),
      imu_(robot.imu, config.initial),
      history_(config),
      legs_(config.legs),
      lidar_(robot.lidar, config.lidar, config.update, config.noise, config.threads),
      map_(config.map, config.lidar, robot.lidar.T_imu_lidar.p),
      frames_(robot.lidar.rate, input_.uses(Sensor::lidar)),
      status_(robot, input_.uses(Sensor::lidar)) {
  if (!input_.uses(Sensor::imu)) throw std::invalid_argument("the IMU is needed: nothing is estimated without it");
  if (config.lidar.voxel_size > map_.surfaces().leaf_size() * (1 + 1e-9))
    throw std::invalid_argument("lidar.voxel_size must be at most a quarter of map.voxel_size");
  if (input_.uses(Sensor::legs)) kinematics_ = std::make_unique<LegKinematics>(robot, config.legs.contact == "force");
  if (input_.uses(Sensor::camera)) vision_.emplace(robot.camera, config.vision, config.visual_map, config.update, config.map.radius);
}

std::vector<Output> Estimator::push(Measurement m) {
  std::vector<Output> out;
  push(std::move(m), out);
  return out;
}

void Estimator::push(Measurement m, std::vector<Output>& out) {
  input_.push(std::move(m));
  if (input_.clock_steps().count() > statistics().clock_steps) findings_.report_clock_steps(situation(), input_.clock_steps());
  if (input_.time_went_back()) begin_new_epoch(out);
  if (input_.health().imu_silence() > blind_gap) lose_imu(out);
  drain(out);
}

std::vector<Output> Estimator::finish() {
  std::vector<Output> out;
  finish(out);
  return out;
}

// What came through the queue, and what did not.
void Estimator::drain(std::vector<Output>& out) {
  for (const auto& [sensor, reason] : input_.take_refused()) findings_.drop(sensor, reason);
  while (auto next = input_.pop()) handle(std::move(*next), out);
}

void Estimator::handle(Measurement m, std::vector<Output>& out) {
  std::optional<FrameQueue::Frame> crowded_out;
  if (!history_.has_begun()) {
    const auto start = starter_.add(std::move(m));
    for (const Sensor s : starter_.take_dropped()) findings_.drop(s, Reason::before_start);
    if (start) begin(*start, out);
  } else if (auto* imu = std::get_if<ImuSample>(&m)) {
    process(*imu, out);
  } else if (const auto* joints = std::get_if<JointSample>(&m)) {
    process(*joints, out);
  } else if (auto* scan = std::get_if<LidarScan>(&m)) {
    crowded_out = frames_.push(std::move(*scan));
  } else if (auto* image = std::get_if<CameraImage>(&m)) {
    if (const auto fault = vision_->fault_of(*image)) {
      if (!fault->detail.empty()) findings_.report(situation(), Sensor::camera, Reason::foreign_images, 0, fault->detail);
      return findings_.drop(Sensor::camera, fault->reason);
    }
    crowded_out = frames_.push(std::move(*image));
  }
  if (crowded_out) findings_.drop(crowded_out->sensor(), Reason::no_imu);
}

void Estimator::begin(const Start& start, std::vector<Output>& out) {
  const Time t = start.estimate.t;
  imu_.set_scale(start.accel_scale);
  // Sweeps see for themselves how a robot settles while it stands.
  history_.begin(start.estimate, input_.uses(Sensor::lidar) ? std::nullopt : start.rest_until);
  status_.begin(t, input_.uses(Sensor::legs));
  // On the move the first sweeps find the velocity, and the legs tell it within a step.
  constexpr Duration to_settle = std::chrono::seconds(2), a_step = std::chrono::seconds(1);
  if (vision_) vision_->begin_at(start.still ? t : t + to_settle);
  lidar_.begin_at(start.still || !input_.uses(Sensor::legs) ? t : t + a_step);
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

// The time went back: another recording, or the same again. What waited belongs to the time before; nothing else is kept.
void Estimator::begin_new_epoch(std::vector<Output>& out) {
  finish(out);
  InputQueue input = input_.next_epoch();
  Estimator fresh(robot_, config_, input.used());
  fresh.input_ = std::move(input);
  fresh.findings_ = findings_.next_epoch();
  if (map_.is_given()) fresh.give_map(map_.take());
  *this = std::move(fresh);
  findings_.report(situation(), {}, Reason::began_anew, to_seconds(input_.clock_steps().last()));
}

void Estimator::finish(std::vector<Output>& out) {
  input_.end();
  frames_.end();
  drain(out);
  // A scan that ends between the last IMU sample and where the next would have been: the last sample is held.
  const Duration period = from_seconds(1.5 / robot_.imu.rate);
  if (history_.has_begun() && history_.replay().has_imu() && frames_.has_one_until(history_.replay().newest_imu().t + period)) {
    ImuSample held = history_.replay().newest_imu();
    held.t = std::max(held.t, frames_.first_end());
    if (held.t > history_.replay().newest_imu().t) history_.add(held);
    process_frames(held.t, out);
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
  // Where the IMU was silent as well, nobody can say that the legs are lost.
  const Time heard = history_.replay().has_imu() ? history_.replay().newest_imu().t : s.t;
  if (to_seconds(s.t - heard) > blind_gap) {
    // Feet may have been lifted and set down in between; the velocity is anything that a walking robot's may be.
    lose_imu(out);
    lidar_.rejoin();
    imu_.restart();
    if (status_.has_legs()) lose_legs(heard);
  }
  status_.imu_is_back();
  history_.add(s);
  imu_.add(s);
  if (s.t < history_.closed().t) return;
  if (status_.are_legs_lost(heard, input_.health())) lose_legs(s.t);
  if (frames_.has_one_until(s.t)) {
    history_.drop_leg_updates_ahead();
    process_frames(s.t, out);
    history_.resume(Estimate(history_.now()));
  }
  history_.close(s.t);
  if (!status_.has_legs()) history_.take_closing_us();
  if (keep_plausible()) history_.remember_good();
  if (s.t - history_.base().t > longest_history && frames_.empty()) history_.rebase_to_closed();
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
  if (status_.imu_lost() || to_seconds(s.t - replay.newest_imu().t) > longest_held_imu(robot_.imu.rate))
    return findings_.drop(Sensor::legs, Reason::no_imu);
  constexpr Duration calm = std::chrono::milliseconds(20);
  const double sigma_v = std::sqrt(std::max(0.0, history_.now().P.block<3, 3>(at::v, at::v).trace() / 3));
  if (!status_.may_legs_return(s.t, imu_.is_calm(s.t, calm), sigma_v < known_velocity, input_.health()))
    return findings_.drop(Sensor::legs, Reason::not_calm);
  auto known = kinematics_->feet(s);
  if (const auto* fault = std::get_if<std::string>(&known)) return findings_.drop(Sensor::legs, Reason::wrong_joints, *fault);
  const Feet& feet = std::get<Feet>(known);
  findings_.use(Sensor::legs);
  if (!status_.has_legs()) legs_.expect_a_stance_from(s.t);
  status_.legs_used(s.t);

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

void Estimator::process_frames(Time until, std::vector<Output>& out) {
  while (auto frame = frames_.pop(until)) {
    if (const auto* scan = std::get_if<LidarScan>(&frame->what)) {
      process(*scan, out);
    } else {
      process(std::get<CameraImage>(frame->what));
    }
  }
}

void Estimator::process(const LidarScan& scan, std::vector<Output>& out) {
  const Time begin = begin_of(scan), end = end_of(scan);
  if (end < history_.base().t) return findings_.drop(Sensor::lidar, Reason::before_state);
  if (history_.replay().is_blind(begin, end)) return findings_.drop(Sensor::lidar, Reason::no_imu);
  if (frames_.last_middle()) lidar_.note_silence(begin - status_.last_sweep());
  Stopwatch watch;
  // The state is updated at the middle of the sweep: half of the points are older, half are younger, so what the IMU gets wrong within
  // the sweep cancels to first order. What came since is propagated again.
  const Time middle = std::max(history_.base().t, end - (end - begin) / 2);
  const Estimate prior = history_.at(middle);
  history_.record_from(prior, end);
  if (!lidar_.has_shape(end, prior)) return findings_.drop(Sensor::lidar, Reason::before_motion);
  Statistics& statistics = findings_.statistics();
  const PoseCovariance map_error = map_.error_at(prior.x.pose());
  const bool first = map_.surfaces().empty();
  const Registration sweep = lidar_.measure(scan, end, prior, history_.trajectory(), map_.surfaces(), map_error, statistics.points);
  statistics.searches += sweep.searched ? 1 : 0;
  statistics.found += sweep.searched && !sweep.refused ? 1 : 0;
  if (sweep.refused) return refuse_sweep(*sweep.refused, prior, end);
  history_.resume(sweep.posterior);
  const bool good = keep_plausible(true);
  Output result;
  result.stages.lidar_us = watch.lap_us();

  const SE3 T_WI = history_.now().x.pose();
  if (good) {
    const auto clock = lidar_.check_clock(prior, sweep.posterior, history_.trajectory(), begin, end, least_offset(input_.is_shifted(Sensor::lidar)));
    if (clock.doubtful && vision_) vision_->restart_mount_check();  // it may see nothing but this
    if (clock.offset) findings_.report_clock_offset(situation(), Sensor::lidar, input_.shift_by(Sensor::lidar, *clock.offset), robot_.lidar.time_offset);
    history_.correct_trajectory(sweep.posterior, sweep.posterior.x.v - prior.x.v);
    lidar_.accept(sweep);
    if (!first && sweep.carries) history_.correlate_with_sweep(end, prior, sweep.posterior);
    map_.learn(sweep, lidar_.unobservable(), lidar_.may_learn(prior, sweep, map_error));
    history_.rebase(sweep.posterior);
  }
  result.stages.map_us = watch.lap_us();

  history_.advance_to(end);
  findings_.use(Sensor::lidar);
  if (sweep.carries) status_.sweep_used(end);
  choose_modality(end);
  frames_.scan_used(middle);
  result.registration = sweep.report;
  result.indicators = indicators_of(sweep.points, sweep.report);
  result.points_W = in_world(sweep.points, T_WI);
  if (vision_) vision_->see(result.points_W);
  result.stages.other_us = watch.lap_us();
  outputs_.add_sweep(std::move(result));
  // While the legs are used it goes out with the next of their samples, which is not earlier than those that have gone.
  if (!status_.has_legs()) emit(history_.now(), out);
}

// A sweep that fits nowhere is not used; when that has lasted, the robot is taken to be outside of the map: it begins anew around it.
void Estimator::refuse_sweep(Reason reason, const Estimate& prior, Time end) {
  findings_.drop(Sensor::lidar, reason);
  if (reason != Reason::fits_nowhere) return;
  history_.resume(prior);
  if (lidar_.refuse(end, map_.is_given())) {
    map_.begin_anew(prior);
    if (vision_) vision_->forget_map();
    ++findings_.statistics().maps_begun_anew;
    findings_.report(situation(), Sensor::lidar, Reason::map_begun_anew);
    findings_.contradict(Reason::diverged, Sensor::lidar, Findings::witness_against(Sensor::lidar, situation()), 2,
                         "for 2 s no sweep fitted the map where it should have been", situation());
  }
  history_.advance_to(end);
}

void Estimator::process(const CameraImage& image) {
  const auto refuse = [this](Reason r) { findings_.drop(Sensor::camera, r); };
  if (const auto reason = vision_->refuses(image.t)) return refuse(*reason);
  const auto motion = history_.motion_since(image.t);
  if (!motion) return refuse(Reason::before_state);
  if (history_.replay().is_blind(image.t, image.t)) return refuse(Reason::no_imu);
  // Vision lives by the surfaces of the LiDAR: without it, nobody can tell what hides what, and images can only drift.
  constexpr double scans = 3.5;
  if (image.t - frames_.last_middle().value_or(Time{}) > from_seconds(scans / robot_.lidar.rate)) return refuse(Reason::no_lidar);
  if (lidar_.is_rejoining()) return refuse(Reason::before_rejoined);
  Stopwatch watch;
  ImageContext context;
  context.prior = history_.at(std::max(image.t, history_.base().t));
  context.T_image = motion->begin;
  context.T_prior = motion->end;
  context.gyro = history_.replay().gyro_at(image.t).value_or(context.prior.x.bg);
  context.unobservable = lidar_.unobservable();
  context.feet_hold = lidar_.is_blind_somewhere() && status_.has_legs() && legs_.has_stood_lately(image.t);
  const VisualRegistration seen = vision_->measure(image, context);
  if (seen.refused == Reason::pose_uncertain) return refuse(*seen.refused);
  if (seen.refused == Reason::not_finite) {
    history_.resume(seen.posterior);
    keep_plausible(true);
    return refuse(Reason::not_finite);
  }
  history_.rebase(seen.posterior);
  if (seen.refused == Reason::mount_doubted) findings_.report_turned_camera(situation(), seen.turned);
  if (seen.refused) return refuse(*seen.refused);
  findings_.use(Sensor::camera);
  history_.correct_trajectory(seen.posterior, seen.posterior.x.v - context.prior.x.v);
  map_.held_against(seen.posterior.x.pose(), seen.drift, context.unobservable);
  Output result;
  result.coloured = vision_->learn(map_.surfaces(), map_.error().total(seen.T_WI, seen.posterior.P.topLeftCorner<6, 6>()));
  if (const auto offset = vision_->clock_offset(least_offset(input_.is_shifted(Sensor::camera))))
    findings_.report_clock_offset(situation(), Sensor::camera, input_.shift_by(Sensor::camera, *offset), robot_.camera.time_offset);
  if (seen.carries) status_.image_used(image.t);
  result.indicators = indicators_of(seen.used);
  result.stages.visual_us = watch.lap_us();
  outputs_.add_image(std::move(result));
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

void Estimator::lose_legs(Time t) {
  history_.end_stances(t);
  legs_.restart();
  status_.lose_legs(findings_.statistics().sensors[static_cast<std::size_t>(Sensor::legs)].used > 0);
}

void Estimator::choose_modality(Time t) {
  const SensorStatus::Change change = status_.choose(t, input_.health());
  if (change == SensorStatus::Change::none) return;
  findings_.report(situation(), {}, status_.cause());
  // What has failed may have been wrong before it was missed, and nothing will tell, m/s.
  constexpr double doubt = 0.003;
  if (change == SensorStatus::Change::of_modality && status_.modality() == Modality::coast && frames_.empty()) history_.inflate_velocity(doubt);
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

void Estimator::emit(const Estimate& e, std::vector<Output>& out, std::optional<Contacts> contacts, double kinematic_us, double contact_us) {
  auto o = outputs_.next(e.t);
  if (!o) return;
  o->epoch = epoch();
  o->x = e.x;
  o->P = e.P;
  o->P.topLeftCorner<6, 6>() += map_.error_at(e.x.pose());
  if (history_.replay().has_imu()) o->omega = history_.replay().newest_imu().gyro - e.x.bg;
  o->modality = status_.modality();
  o->cause = status_.cause();
  if (findings_.has_news()) o->events = findings_.take_events();
  o->contacts = contacts;
  o->kinematic_us = kinematic_us;
  o->contact_us = contact_us;
  out.push_back(std::move(*o));
}

bool Estimator::fork(LivePropagator& into) const {
  if (!history_.has_begun() || !history_.replay().has_imu()) return false;
  into.become(history_, legs_, imu_, status_, map_.error_at(history_.now().x.pose()), epoch());
  return true;
}

}  // namespace kilvo
