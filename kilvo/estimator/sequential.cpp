// The sequential phase: sweeps and images update the state at their own times; what came since is propagated again.
#include <algorithm>
#include <numbers>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/filter/gap.hpp"
#include "kilvo/math/decimals.hpp"
#include "kilvo/math/stopwatch.hpp"

namespace kilvo {
namespace {

std::vector<PointXYZI> in_world(std::vector<PointXYZI> points_I, const SE3& T_WI) {
  const Eigen::Matrix3f R = T_WI.R.matrix().cast<float>();
  const Eigen::Vector3f p = T_WI.p.cast<float>();
  for (PointXYZI& x : points_I) x.head<3>() = (R * x.head<3>() + p).eval();
  return points_I;
}

// Of the part that a sweep did not know: a direction of the position in it.
std::optional<Eigen::Vector3d> direction_of(const PoseCovariance& part) {
  const Eigen::Matrix3d position = part.bottomRightCorner<3, 3>();
  Eigen::Index most = 0;
  if (position.diagonal().maxCoeff(&most) < 1.0 / 3) return std::nullopt;
  return position.col(most).normalized();
}

// `expected`: before the sweep.
void judge(const PredictionCheck& check, const State& expected, const Registration& sweep, const Findings::Situation& now,
           Findings& findings) {
  findings.statistics().searches += sweep.searched ? 1 : 0;
  findings.statistics().found += sweep.searched && !sweep.refused ? 1 : 0;
  const auto off = PredictionCheck::error_between(expected, sweep.posterior.x);
  if (sweep.unpredicted && !PredictionCheck::is_small(off))
    findings.report(now, Sensor::lidar, Reason::not_where_predicted, off.moved,
                    decimals(off.moved, 2) + " m and " + decimals(off.turned * 180 / std::numbers::pi, 1) + " degrees");
  if (check.lies_beside_for_long() && (sweep.carries || sweep.refused == Reason::fits_nowhere))
    findings.contradict(Reason::inconsistent, Sensor::lidar, Findings::witness_against(Sensor::lidar, now), off.moved,
                        "sweeps lie beside the map, at the predicted pose and near by: the robot, or much around it, was moved", now);
  if (!check.lasts() && (!check.is_hopeless() || findings.statistics().diverged)) return;
  findings.contradict(check.is_hopeless() ? Reason::diverged : Reason::inconsistent, Sensor::imu, Sensor::lidar,
                      check.error().value_or(PredictionCheck::Error{}).moved,
                      "a bias, the scale or the clock of one has changed, or its mount is wrong", now);
}

}  // namespace

void Estimator::process(const LidarScan& scan, const FrameQueue::Frame& frame, std::vector<Output>& out) {
  const Time begin = frame.begin, end = frame.end;
  if (end < history_.base().t) return findings_.drop(Sensor::lidar, Reason::before_state);
  if (history_.replay().is_blind(begin, end)) return findings_.drop(Sensor::lidar, Reason::no_imu);
  if (frames_.last_middle()) lidar_.note_silence(begin - *status_.last_used(Sensor::lidar));
  if (moving_start_ && !moving_start_->is_over()) {
    if (!status_.has_legs()) {
      if (moving_start_->add(scan, history_, findings_.statistics().points)) status_.use(Sensor::lidar, end);
      keep_plausible(true);
      return findings_.drop(Sensor::lidar, Reason::before_motion);
    }
    moving_start_->give_up(history_, history_.now().t);
  }
  Stopwatch watch;
  // The state is updated at the middle of the sweep: half of the points are older, half are younger, so what the IMU gets wrong within
  // the sweep cancels to first order. What came since is propagated again.
  const Time middle = std::max(history_.base().t, end - (end - begin) / 2);
  Estimate prior = history_.at(middle);
  history_.record_from(prior, end);
  if (!lidar_.has_shape(end, prior)) return findings_.drop(Sensor::lidar, Reason::before_motion);
  const bool first = map_.surfaces().empty(), without_legs = !status_.has_legs();
  const State expected = prior.x;
  const Registration sweep = map_.register_sweep(lidar_, {scan, end, without_legs, legs_.description_error(prior.x)}, history_, prior,
                                                 findings_.statistics().points);
  judge(map_.prediction(), expected, sweep, situation(), findings_);
  if (sweep.refused) {
    findings_.drop(Sensor::lidar, *sweep.refused);
    if (sweep.refused != Reason::fits_nowhere) return;
    history_.resume(prior);
    if (map_.refuse_sweep(lidar_, prior, end)) {
      if (vision_) vision_->forget_map();
      findings_.report_new_map(situation());
    }
    return history_.advance_to(end);
  }
  if (sweep.searched) lidar_.rejoin();
  history_.resume(sweep.posterior);
  const bool good = keep_plausible(true);
  Output result;
  if (config_.sweep_updates && good && !first && sweep.is_plain())
    result.update = std::make_shared<SweepUpdate>(history_.base(), prior, sweep.posterior, history_.replay().samples());
  result.stages.lidar_us = watch.lap_us();

  const SE3 T_WI = history_.now().x.pose();
  if (good) {
    const auto clock = lidar_.compare_turns(prior, sweep.posterior, history_.trajectory(), begin, end);
    if (clock.doubtful && vision_) vision_->restart_mount_check();  // it may see nothing but this
    if (clock.offset)
      findings_.report_clock_offset(situation(), Sensor::lidar, input_.shift_by(Sensor::lidar, *clock.offset),
                                    input_.robot().lidar.time_offset);
    history_.correct_trajectory(sweep.posterior, sweep.posterior.x.v - prior.x.v);
    lidar_.accept(sweep);
    findings_.note_unmeasured(situation(), without_legs ? direction_of(lidar_.unobservable()) : std::nullopt);
    if (!first && sweep.carries) history_.correlate_with_sweep(end, prior, sweep.posterior, without_legs, lidar_.is_blind_somewhere());
    if (first) map_.begin_at(T_WI, legs_.description_error(sweep.posterior.x));
    if (first && moving_start_) map_.begin_at(T_WI, moving_start_->error_at(T_WI));
    map_.learn(sweep, lidar_.unobservable(), first || lidar_.may_learn(prior, sweep, map_.error_at(prior.x.pose())));
    moving_start_.reset();
    history_.rebase(sweep.posterior);
  }
  result.stages.map_us = watch.lap_us();

  history_.advance_to(end);
  findings_.use(Sensor::lidar);
  if (sweep.carries) status_.use(Sensor::lidar, end);
  if (sweep.carries && !first) legs_.pose_is_measured(lidar_.unobservable().bottomRightCorner<3, 3>());
  choose_modality(end);
  frames_.scan_used(middle);
  result.registration = sweep.report;
  result.indicators = indicators_of(sweep.points, sweep.report);
  if (vision_ || config_.sweep_points) result.points_W = in_world(sweep.points, T_WI);
  if (vision_) vision_->see(result.points_W);
  result.stages.other_us = watch.lap_us();
  outputs_.add_sweep(std::move(result));
  // While the legs are used it goes out with the next of their samples, which is not earlier than those that have gone.
  if (!status_.has_legs()) emit(history_.now(), out);
}

void Estimator::process(const CameraImage& image, const FrameQueue::Frame&, std::vector<Output>&) {
  const auto refuse = [this](Reason r) { findings_.drop(Sensor::camera, r); };
  if (const auto reason = vision_->refuses(image.t)) return refuse(*reason);
  const auto motion = history_.motion_since(image.t);
  if (!motion) return refuse(Reason::before_state);
  if (history_.replay().is_blind(image.t, image.t)) return refuse(Reason::no_imu);
  // Vision needs the surfaces of the LiDAR: without it occlusions are unknown, and images can only drift.
  const double rate = input_.robot().lidar.rate;
  if (is_silence(image.t - frames_.last_middle().value_or(Time{}) - from_seconds(0.5 / rate), rate)) return refuse(Reason::no_lidar);
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
  if (seen.refused == Reason::mount_doubted) findings_.report_turned_camera(situation(), seen.turned.by, seen.turned.corrected);
  if (seen.refused) return refuse(*seen.refused);
  findings_.use(Sensor::camera);
  history_.correct_trajectory(seen.posterior, seen.posterior.x.v - context.prior.x.v);
  if (!seen.drift.empty()) findings_.note_unmeasured(situation(), std::nullopt);
  map_.held_against(seen.posterior.x.pose(), seen.drift, context.unobservable);
  Output result;
  result.coloured = vision_->learn(map_.surfaces(), map_.error().total(seen.T_WI, seen.posterior.P.topLeftCorner<6, 6>()));
  if (const auto offset = vision_->clock_offset())
    findings_.report_clock_offset(situation(), Sensor::camera, input_.shift_by(Sensor::camera, *offset), input_.robot().camera.time_offset);
  if (seen.carries) {
    status_.use(Sensor::camera, image.t);
    findings_.camera_carries();
  }
  result.indicators = indicators_of(seen.used, seen.carries);
  result.stages.visual_us = watch.lap_us();
  outputs_.add_image(std::move(result));
}

}  // namespace kilvo
