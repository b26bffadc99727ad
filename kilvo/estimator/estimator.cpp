#include "kilvo/estimator/estimator.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "kilvo/estimator/fault.hpp"
#include "kilvo/estimator/live_propagator.hpp"

namespace kilvo {
namespace {

// Undistortion never looks farther back than this.
constexpr Duration trajectory_length = std::chrono::milliseconds(500);
// Scans and images that wait for the IMU: more than two seconds of them are not worth waiting for.
constexpr std::size_t max_pending = 60;
// theta_d: an acceleration so many standard deviations from its usual is an impact.
constexpr double unusual_acceleration = 10;
// What is thrown away took no less time than this, s.
constexpr double least_gap = 0.02;
// A walking machine that is faster than this, or so uncertain, has lost itself, m/s, m.
constexpr double absurd_speed = 30, absurd_sigma = 1e4;

bool is_sane(const Estimate& e) {
  return is_finite(e) && e.x.v.norm() < absurd_speed && e.P.diagonal().minCoeff() > -1e-12 &&
         e.P.diagonal().segment<3>(at::p).maxCoeff() < absurd_sigma * absurd_sigma;
}

// But for rounding: what is known exactly, and feet that do not stand, have no variance.
bool is_definite(const Covariance& P) { return P.ldlt().vectorD().minCoeff() > -1e-9; }

}  // namespace

Estimator::Estimator(const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used)
    : robot_(robot),
      config_(config),
      used_(used),
      timeline_(used, from_seconds(config.max_wait), config.wait_for_images),
      initialiser_(config.initial, config.gravity_align, config.noise.accel),
      replay_(config),
      trajectory_(trajectory_length),
      map_(config.map),
      workers_(config.threads),
      visual_map_(config.visual_map),
      contacts_(config.legs),
      stances_(config.legs),
      clipping_(robot.imu.gyro_range, robot.imu.accel_range),
      health_(robot),
      stationarity_(config.initial, unusual_acceleration) {
  if (!uses(Sensor::imu)) throw std::invalid_argument("the IMU is needed: nothing is estimated without it");
  if (config.lidar.voxel_size > map_.leaf_size() * (1 + 1e-9))
    throw std::invalid_argument("lidar.voxel_size must be at most a quarter of map.voxel_size");
  if (uses(Sensor::legs)) kinematics_ = std::make_unique<LegKinematics>(robot, config.legs.contact == "force");
  if (uses(Sensor::camera)) camera_.emplace(robot.camera);
  T_CI_ = robot.camera.T_imu_camera.inverse();
}

void Estimator::give_map(VoxelMap map) {
  map_ = std::move(map);
  map_is_given_ = true;
}

std::vector<Output> Estimator::push(Measurement m) {
  std::vector<Output> out;
  push(std::move(m), out);
  return out;
}

void Estimator::push(Measurement m, std::vector<Output>& out) {
  const Sensor s = sensor_of(m);
  if (!used_[static_cast<std::size_t>(s)]) return drop(s, Reason::not_used);
  const auto back = clock_steps_.follow(m);  // whatever it says, it has a time
  if (clock_steps_.count() > statistics_.clock_steps) note_clock_step();
  if (clock_steps_.restarts() > epoch_) begin_new_epoch(out);
  if (const auto fault = fault_of(m)) return drop(s, *fault);
  if (back) return drop(s, *back);
  if (const auto fault = health_.judge(m)) return drop(s, *fault);
  shift(m);
  if (health_.imu_silence() > blind_gap) lose_imu(out);
  if (const auto refused = timeline_.push(std::move(m))) return drop(s, *refused);
  for (const Sensor jumped : timeline_.take_jumped()) drop(jumped, Reason::time_jump);
  for (const Sensor waited : timeline_.take_given_up()) drop(waited, Reason::no_imu);
  while (auto next = timeline_.pop()) handle(*next, out);
}

// The time went back: another recording, or the same again. What waited belongs to the time before; nothing else is kept.
void Estimator::begin_new_epoch(std::vector<Output>& out) {
  const double back = to_seconds(clock_steps_.last());
  finish(out);
  Estimator fresh(robot_, config_, used_);
  fresh.epoch_ = epoch_ + 1;
  fresh.clock_steps_ = clock_steps_;
  fresh.statistics_ = std::move(statistics_);
  fresh.statistics_.epochs = fresh.epoch_ + 1;
  fresh.events_ = std::move(events_);
  fresh.drops_ = drops_;
  if (map_is_given_) fresh.give_map(std::move(map_));
  *this = std::move(fresh);
  report({}, Reason::began_anew, back);
}

std::vector<Output> Estimator::finish() {
  std::vector<Output> out;
  finish(out);
  return out;
}

void Estimator::finish(std::vector<Output>& out) {
  timeline_.end();
  ended_ = true;
  for (const Sensor jumped : timeline_.take_jumped()) drop(jumped, Reason::time_jump);
  while (auto next = timeline_.pop()) handle(*next, out);
  // A scan that ends between the last IMU sample and where the next would have been: the last sample is held.
  const Duration period = from_seconds(1.5 / robot_.imu.rate);
  if (estimate_ && replay_.has_imu() && !pending_.empty() && pending_.front().end <= replay_.newest_imu().t + period) {
    ImuSample held = replay_.newest_imu();
    held.t = std::max(held.t, pending_.front().end);
    if (held.t > replay_.newest_imu().t) replay_.add(held);
    process_pending(held.t, out);
    if (!sweeps_.empty() && estimate_->t < held.t) replay_.advance(*estimate_, held.t, &trajectory_);
  }
  while (!sweeps_.empty() || !images_.empty()) {
    // Each has a time of its own, after what has gone out already.
    if (last_output_) replay_.advance(*estimate_, std::max(estimate_->t, *last_output_ + Duration(1000)), &trajectory_);
    emit(out);
  }
  for (const Pending& p : pending_) drop(p.sensor(), Reason::no_imu);
  pending_.clear();
  for (const Measurement& m : before_start_) drop(sensor_of(m), Reason::before_start);
  before_start_.clear();
  report_streams();
  report_use({});
}

void Estimator::handle(Measurement& m, std::vector<Output>& out) {
  if (!estimate_) {
    handle_before_start(m, out);
  } else if (auto* imu = std::get_if<ImuSample>(&m)) {
    handle_imu(*imu, out);
  } else if (const auto* joints = std::get_if<JointSample>(&m)) {
    handle_legs(*joints, out);
  } else if (auto* scan = std::get_if<LidarScan>(&m)) {
    const Time end = completion_of(m);
    const Time begin = begin_of(*scan);
    wait_for_imu({std::move(*scan), begin, end});
  } else if (auto* image = std::get_if<CameraImage>(&m)) {
    const Time t = image->t;
    if (const auto fault = image_fault(*image)) return drop(Sensor::camera, *fault);
    wait_for_imu({std::move(*image), t, t});
  }
}

void Estimator::wait_for_imu(Pending what) {
  const auto after = std::ranges::upper_bound(pending_, what.end, {}, &Pending::end);
  pending_.insert(after, std::move(what));
  if (pending_.size() <= max_pending) return;
  drop(pending_.front().sensor(), Reason::no_imu);
  pending_.pop_front();
}

void Estimator::handle_before_start(Measurement& m, std::vector<Output>& out) {
  std::optional<Start> start;
  if (const auto* imu = std::get_if<ImuSample>(&m)) start = initialiser_.add(*imu);
  before_start_.push_back(std::move(m));
  bound_images_before_start();
  // A moving start looks this far back and no farther.
  const Time oldest = completion_of(before_start_.back()) - from_seconds(config_.initial.moving_start + 1.0);
  while (completion_of(before_start_.front()) < oldest) {
    drop(sensor_of(before_start_.front()), Reason::before_start);
    before_start_.pop_front();
  }
  if (start) begin(*start, out);
}

// Images are large, and only those of the still window will be of use.
void Estimator::bound_images_before_start() {
  constexpr int most = 8;
  const auto is_image = [](const Measurement& m) { return std::holds_alternative<CameraImage>(m); };
  if (!is_image(before_start_.back()) || std::ranges::count_if(before_start_, is_image) <= most) return;
  before_start_.erase(std::ranges::find_if(before_start_, is_image));
  drop(Sensor::camera, Reason::before_start);
}

void Estimator::begin(const Start& start, std::vector<Output>& out) {
  accel_scale_ = start.accel_scale;
  estimate_ = anchor_ = closed_ = good_ = start.estimate;
  last_sweep_ = start.estimate.t;
  // Sweeps see for themselves how a robot settles while it stands.
  if (!uses(Sensor::lidar)) replay_.began_at_rest(start.rest_until);
  if (uses(Sensor::legs)) last_legs_ = start.estimate.t;  // taken as there until they stay silent
  trajectory_.push(estimate_->t, estimate_->x.pose(), estimate_->x.v);
  // On the move the first sweeps find the velocity; patches kept before that would be kept at wrong places.
  constexpr Duration to_settle = std::chrono::seconds(2);
  images_from_ = start.still ? start.estimate.t : start.estimate.t + to_settle;
  // A sweep of an unknown velocity has no shape, and along a corridor nothing would show it. The legs tell the velocity within a step.
  constexpr Duration a_step = std::chrono::seconds(1);
  sweeps_from_ = start.still || !uses(Sensor::legs) ? start.estimate.t : start.estimate.t + a_step;
  if (!start.still) report({}, Reason::moving_start);
  const double norm = start.resting_norm * start.accel_scale;
  if (std::abs(norm - standard_gravity) > 0.1 * standard_gravity) report(Sensor::imu, Reason::strange_gravity, start.resting_norm);
  // Since the robot stood still, what came during the window is as good as what comes now.
  std::deque<Measurement> waiting;
  waiting.swap(before_start_);
  for (Measurement& m : waiting) {
    if (completion_of(m) < estimate_->t) {
      drop(sensor_of(m), Reason::before_start);
    } else {
      handle(m, out);
    }
  }
}

bool Estimator::keep_finite(bool definite) {
  if (is_sane(*estimate_) && (!definite || is_definite(estimate_->P))) return true;
  // Back to the last good state. Where the robot went since, nobody knows: about as far as it was going.
  const Time t = std::max(estimate_->t, good_.t);
  const double lost = to_seconds(t - good_.t);
  const double thrown = estimate_->x.v.allFinite() ? std::min(absurd_speed, (estimate_->x.v - good_.x.v).norm()) : absurd_speed;
  good_.x.p += lost * good_.x.v;
  inflate_covariance_over_gap(good_, good_.t, t, std::max(lost, least_gap));
  good_.t = t;
  // What made the velocity absurd may have begun before.
  good_.P.diagonal().segment<3>(at::v).array() += thrown * thrown;
  anchor_ = good_;
  for (std::size_t side = 0; side < 2; ++side) end_stance(anchor_, side);
  estimate_ = closed_ = good_ = anchor_;
  replay_.clear_steps();
  stances_.restart();
  contacts_.restart();
  ++statistics_.rollbacks;
  trajectory_.clear();
  trajectory_.push(t, estimate_->x.pose(), estimate_->x.v);
  report({}, Reason::state_thrown_away, lost);
  return false;
}

// One output for each time: of two, the first has said it all.
void Estimator::emit(std::vector<Output>& out, std::optional<Contacts> contacts, double kinematic_us, double contact_us) {
  if (last_output_ && estimate_->t <= *last_output_) return;
  last_output_ = estimate_->t;
  Output o = output_now();
  o.contacts = contacts;
  o.kinematic_us = kinematic_us;
  o.contact_us = contact_us;
  out.push_back(std::move(o));
}

Output Estimator::output_now() {
  Output o;
  if (!sweeps_.empty()) {
    o = std::move(sweeps_.front());
    sweeps_.pop_front();
  }
  if (!images_.empty()) {
    o.is_image = true;
    o.stages.visual_us = images_.front().stages.visual_us;
    o.coloured = std::move(images_.front().coloured);
    std::ranges::copy(images_.front().indicators, std::back_inserter(o.indicators));
    images_.pop_front();
  }
  o.t = estimate_->t;
  o.epoch = epoch_;
  o.x = estimate_->x;
  o.P = estimate_->P;
  o.P.topLeftCorner<6, 6>() += map_error_.at(estimate_->x.pose());
  if (replay_.has_imu()) o.omega = replay_.newest_imu().gyro - o.x.bg;
  o.modality = modality_;
  o.cause = cause_;
  if (events_.has_news()) o.events = events_.take();
  return o;
}

bool Estimator::fork(LivePropagator& into) const {
  if (!estimate_ || !replay_.has_imu()) return false;
  into.started_ = true;
  into.imu_lost_ = recovery_.imu_lost;
  into.accel_scale_ = accel_scale_;
  into.closed_ = closed_;
  into.now_ = *estimate_;
  into.replay_.copy_since(closed_.t, replay_);
  into.contacts_ = contacts_;
  into.stances_ = stances_;
  into.clipping_ = clipping_;
  into.last_legs_ = last_legs_;
  into.leg_period_ = leg_period_;
  into.epoch_ = epoch_;
  into.modality_ = modality_;
  into.cause_ = cause_;
  into.map_error_ = map_error_.at(estimate_->x.pose());
  into.with_legs_ = false;
  return true;
}

}  // namespace kilvo
