// The sequential phase: a sweep updates the state at its middle; what came since is replayed.
#include <algorithm>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/estimator/stopwatch.hpp"
#include "kilvo/lidar/downsample.hpp"
#include "kilvo/lidar/undistort.hpp"

namespace kilvo {
namespace {

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

// What the IMU gets wrong in the second half of a sweep also moved the points taken then: the share of the process noise until the end
// that a sweep's correction of the middle has taken off. Half of it goes with the points' mean, G = 1 - P+ P^-1 of that into the pose:
// P(end) = P+ + Q - G Q / 4 - Q G' / 4.
template <int part>
double shared_with_sweep(const Estimate& prior, const Estimate& posterior) {
  const Eigen::Matrix3d left = posterior.P.block<3, 3>(part, part) * prior.P.block<3, 3>(part, part).inverse();
  return 0.5 * std::clamp(1 - left.trace() / 3, 0.0, 1.0);
}

}  // namespace

void Estimator::rebase(const Estimate& e) {
  anchor_ = e;
  replay_.forget_before(anchor_.t);
}

// The map grows by what a sweep saw, and takes over how uncertain the pose was.
void Estimator::learn(const LidarModel& model, const std::vector<PointCluster>& clusters, bool registered) {
  const SE3 T_WI = estimate_->x.pose();
  if (registered) map_error_.registered(T_WI, model.by_epoch(), model.systematic(), unobservable_);
  const std::uint32_t epoch = map_error_.epoch_now(T_WI, estimate_->P.topLeftCorner<6, 6>());
  const std::vector<PointGroup> seen = to_world(clusters, T_WI, robot_.lidar.T_imu_lidar.p, config_.lidar);
  map_.insert(seen, epoch);
  map_.see_through(T_WI * robot_.lidar.T_imu_lidar.p, seen);
  map_.forget(estimate_->x.p);
}

// Sweeps and images update the state at their own times, in the order of these: the middle of a sweep, the stamp of an image.
void Estimator::process_pending(Time until, std::vector<Output>& out) {
  while (!pending_.empty() && pending_.front().end <= until) {
    auto next = pending_.begin();
    if (std::holds_alternative<CameraImage>(next->what)) {
      const Time image = next->end;
      const auto before = std::ranges::find_if(
          pending_, [&](const Pending& p) { return p.end <= until && p.middle() <= image && std::holds_alternative<LidarScan>(p.what); });
      if (before == pending_.end() && waits_for_scan(image, until)) return;
      if (before != pending_.end()) next = before;
    }
    const Pending chosen = std::move(*next);
    pending_.erase(next);
    if (const auto* scan = std::get_if<LidarScan>(&chosen.what)) {
      process(*scan, chosen.end, out);
    } else {
      process(std::get<CameraImage>(chosen.what));
    }
  }
}

// A scan whose middle is before the image is still being taken: it goes first, if it comes at all.
bool Estimator::waits_for_scan(Time image, Time until) const {
  if (ended_) return false;
  const Duration period = from_seconds(1 / robot_.lidar.rate);
  const bool expected = uses(Sensor::lidar) && last_middle_ != Time{} && last_middle_ + period <= image;
  const bool has_passed =
      std::ranges::any_of(pending_, [image](const Pending& p) { return std::holds_alternative<LidarScan>(p.what) && p.middle() > image; });
  return expected && !has_passed && until < image + 6 * period / 10 && image - last_middle_ < 3 * period;
}

bool Estimator::has_no_shape(const Estimate& prior) const {
  return prior.P.diagonal().segment<3>(at::v).maxCoeff() > known_velocity * known_velocity;
}

void Estimator::process(const LidarScan& scan, Time end, std::vector<Output>& out) {
  if (end < anchor_.t) return drop(Sensor::lidar, Reason::before_state);
  if (replay_.is_blind(begin_of(scan), end)) return drop(Sensor::lidar, Reason::no_imu);
  note_outage(begin_of(scan));
  Stopwatch watch;
  // The state is updated at the middle of the sweep: half of the points are older, half are younger, so what the IMU gets wrong within
  // the sweep cancels to first order. What came since is replayed.
  const Time centre = std::max(anchor_.t, end - (end - begin_of(scan)) / 2);
  Estimate prior = replay_.nearest(centre, anchor_);
  replay_.advance(prior, centre, &trajectory_);
  Estimate ahead = replay_.nearest(end, prior);
  replay_.advance(ahead, end, &trajectory_);
  if (end < sweeps_from_ && has_no_shape(prior)) return drop(Sensor::lidar, Reason::before_motion);
  const std::vector<PointXYZI> points = undistort(scan, trajectory_, centre, robot_.lidar, statistics_.points);
  if (points.empty()) return drop(Sensor::lidar, Reason::no_usable_point);
  const std::vector<PointCluster> clusters = downsample(points, prior.x.pose(), config_.lidar.voxel_size, config_.lidar.reach());
  const Eigen::Vector3d p_IL = robot_.lidar.T_imu_lidar.p;
  LidarConfig lidar = config_.lidar;
  // With hysteresis: each change of mind would hand what was drifted since to the map.
  constexpr double to_leave = 3.0;
  if (!unobservable_.isZero(0)) lidar.weak_share *= to_leave;
  LidarModel model(map_, clusters, p_IL, map_error_.at(prior.x.pose()), lidar, workers_);
  const UndistortionNoise within_scan = undistortion_noise(config_.noise, end - centre);
  const bool first = map_.empty();
  if (!register_sweep(prior, model, clusters, within_scan)) {
    refuse_sweep(end);
    return replay_.advance(*estimate_, end, &trajectory_);
  }
  // What holds less than three directions is no registration: it would carry the estimate while the modality says that legs do.
  const bool enough = first || says_enough(model.report());
  if (!enough) estimate_ = prior;
  const bool good = keep_finite(true);
  StageTimes stages;
  stages.lidar_us = watch.lap_us();

  const SE3 T_WI = estimate_->x.pose();
  if (good) {
    check_lidar_clock(prior, begin_of(scan), end);
    trajectory_.correct(centre, T_WI, estimate_->x.v - prior.x.v);
    unobservable_ = enough ? weak_part(model.report().degeneracy) : PoseCovariance::Identity();
    if (!first && enough)
      replay_.correlate_with_sweep(end, shared_with_sweep<at::R>(prior, *estimate_), shared_with_sweep<at::p>(prior, *estimate_));
    const bool sure = may_learn(prior, model.report());
    if (map_is_given_ && enough) map_error_.registered_to_given(T_WI, model.by_epoch(), model.systematic(), unobservable_);
    if (!map_is_given_ && sure) learn(model, clusters, enough);
    rebase(*estimate_);
  }
  stages.map_us = watch.lap_us();

  replay_.advance(*estimate_, end, &trajectory_);
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::lidar)].used;
  if (enough) last_sweep_ = end;
  choose_modality(end);
  Output& sweep = sweeps_.emplace_back();
  sweep.is_sweep = true;
  sweep.registration = model.report();
  sweep.indicators = indicators_of(points, model.report());
  sweep.points_W = in_world(points, T_WI);
  if (uses(Sensor::camera)) seen_W_ = sweep.points_W;
  last_middle_ = centre;
  sweep.stages = stages;
  sweep.stages.other_us = watch.lap_us();
  // While the legs are used it goes out with the next of their samples, which is not earlier than those that have gone.
  if (!last_legs_) emit(out);
}

}  // namespace kilvo
