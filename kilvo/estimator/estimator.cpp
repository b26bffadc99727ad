#include "kilvo/estimator/estimator.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "kilvo/lidar/downsample.hpp"
#include "kilvo/lidar/undistort.hpp"

namespace kilvo {
namespace {

// Undistortion never looks farther back than this.
constexpr Duration trajectory_length = std::chrono::milliseconds(500);
// Scans that wait for the IMU: more than two seconds of them are not worth waiting for.
constexpr std::size_t max_pending = 20;
// Before the start, as much as a moving start may need.
constexpr std::size_t max_before_start = 200000;
// A walking machine that is faster than this has lost itself.
constexpr double absurd_speed = 30;  // m/s

class Stopwatch {
 public:
  double lap_us() {
    const auto now = std::chrono::steady_clock::now();
    const double us = std::chrono::duration<double, std::micro>(now - start_).count();
    start_ = now;
    return us;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// What no sensor measures; nullptr: nothing wrong.
const char* fault_of(const Measurement& m) {
  constexpr double absurd_gyro = 300, absurd_accel = 5000;  // rad/s, m/s^2 (or g): beyond any IMU's range
  if (const auto* imu = std::get_if<ImuSample>(&m)) {
    if (!imu->gyro.allFinite() || !imu->accel.allFinite()) return "not finite";
    if (imu->gyro.norm() > absurd_gyro || imu->accel.norm() > absurd_accel) return "absurd value";
  }
  if (const auto* scan = std::get_if<LidarScan>(&m); scan != nullptr && scan->points.empty()) return "empty";
  return nullptr;
}

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

}  // namespace

Estimator::Estimator(const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used)
    : robot_(robot),
      config_(config),
      used_(used),
      timeline_(used, from_seconds(config.max_wait)),
      initialiser_(config.initial, config.gravity_align),
      trajectory_(trajectory_length),
      map_(config.map),
      workers_(config.threads) {
  if (!used[static_cast<std::size_t>(Sensor::imu)]) throw std::invalid_argument("the IMU is needed: nothing is estimated without it");
  if (config.lidar.voxel_size > map_.leaf_size() * (1 + 1e-9))
    throw std::invalid_argument("lidar.voxel_size must be at most a quarter of map.voxel_size");
}

std::vector<Output> Estimator::push(Measurement m) {
  std::vector<Output> out;
  const Sensor s = sensor_of(m);
  if (!used_[static_cast<std::size_t>(s)]) {
    drop(s, "not used");
    return out;
  }
  if (const char* fault = fault_of(m)) {
    drop(s, fault);
    return out;
  }
  if (const auto refused = timeline_.push(std::move(m))) {
    drop(s, *refused);
    return out;
  }
  for (const Sensor jumped : timeline_.take_jumped()) drop(jumped, "time jump");
  while (auto next = timeline_.pop()) handle(*next, out);
  return out;
}

std::vector<Output> Estimator::finish() {
  std::vector<Output> out;
  timeline_.end();
  for (const Sensor jumped : timeline_.take_jumped()) drop(jumped, "time jump");
  while (auto next = timeline_.pop()) handle(*next, out);
  // A scan that ends between the last IMU sample and where the next would have been: the last sample is held.
  const Duration period = from_seconds(1.5 / robot_.imu.rate);
  while (estimate_ && !imu_.empty() && !pending_.empty() && pending_.front().end <= imu_.back().t + period) {
    const PendingScan next = std::move(pending_.front());
    pending_.pop_front();
    if (next.end > imu_.back().t) {
      imu_.push_back(imu_.back());
      imu_.back().t = next.end;
    }
    process(next.scan, next.end, out);
  }
  for (std::size_t i = 0; i < pending_.size(); ++i) drop(Sensor::lidar, "no IMU");
  pending_.clear();
  for (const Measurement& m : before_start_) drop(sensor_of(m), "before the start");
  before_start_.clear();
  return out;
}

void Estimator::handle(Measurement& m, std::vector<Output>& out) {
  if (!estimate_) {
    handle_before_start(m, out);
  } else if (auto* imu = std::get_if<ImuSample>(&m)) {
    handle_imu(*imu, out);
  } else if (auto* scan = std::get_if<LidarScan>(&m)) {
    const Time end = completion_of(m);
    pending_.push_back({std::move(*scan), end});
    bound_pending();
  }
}

void Estimator::bound_pending() {
  if (pending_.size() <= max_pending) return;
  pending_.pop_front();
  drop(Sensor::lidar, "no IMU");
}

void Estimator::handle_before_start(Measurement& m, std::vector<Output>& out) {
  std::optional<Start> start;
  if (const auto* imu = std::get_if<ImuSample>(&m)) start = initialiser_.add(*imu);
  before_start_.push_back(std::move(m));
  if (before_start_.size() > max_before_start) {
    drop(sensor_of(before_start_.front()), "before the start");
    before_start_.pop_front();
  }
  if (start) begin(*start, out);
}

void Estimator::begin(const Start& start, std::vector<Output>& out) {
  accel_scale_ = start.accel_scale;
  estimate_ = anchor_ = start.estimate;
  trajectory_.push(estimate_->t, estimate_->x.pose(), estimate_->x.v);
  if (!start.still) statistics_.warnings.push_back("the robot did not stand still: started on the move, with wide uncertainties");
  const double norm = start.resting_norm * start.accel_scale;
  if (std::abs(norm - standard_gravity) > 0.1 * standard_gravity) {
    statistics_.warnings.push_back("the accelerometer measured " + std::to_string(start.resting_norm) +
                                   " at the start: neither 9.8 m/s^2 nor 1 g");
  }
  // Since the robot stood still, what came during the window is as good as what comes now.
  std::deque<Measurement> waiting;
  waiting.swap(before_start_);
  for (Measurement& m : waiting) {
    if (completion_of(m) < estimate_->t) {
      drop(sensor_of(m), "before the start");
    } else {
      handle(m, out);
    }
  }
}

// The closed interval [begin, end] between two samples; when nobody saw the motion in between, with noise that says so.
ImuInterval Estimator::interval_between(const ImuSample& a, const ImuSample& b, Time begin, Time end, const State& x) const {
  ImuInterval interval = ImuInterval::between(a, b, begin, end);
  const double gap = to_seconds(b.t - a.t);
  if (gap <= config_.max_imu_gap) return interval;
  constexpr double unknown_accel = 3.0;  // m/s^2, constant over the gap: as a density, times the gap
  interval.noise_scale = unknown_accel * unknown_accel * gap / (config_.noise.accel * config_.noise.accel);
  constexpr double blind = 1.0;  // s; after longer than this the two samples say nothing of the time between
  if (gap > blind) {
    interval.gyro_begin = interval.gyro_end = x.bg;
    interval.accel_begin = interval.accel_end = x.ba - x.R.inverse() * x.g;
  }
  return interval;
}

void Estimator::propagate(Estimate& e, Time until) {
  // The sample at or before e.t.
  auto next = std::upper_bound(imu_.begin(), imu_.end(), e.t, [](Time t, const ImuSample& s) { return t < s.t; });
  while (e.t < until && next != imu_.end()) {
    const ImuSample& a = next == imu_.begin() ? *next : *(next - 1);
    const Time end = std::min(until, next->t);
    e = predict(e, interval_between(a, *next, e.t, end, e.x), {}, config_.noise);
    trajectory_.push(e.t, e.x.pose(), e.x.v);
    ++next;
  }
}

void Estimator::handle_imu(ImuSample s, std::vector<Output>& out) {
  s.accel *= accel_scale_;
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::imu)].used;
  imu_.push_back(s);
  if (s.t < estimate_->t) return;
  while (!pending_.empty() && pending_.front().end <= s.t) {
    const PendingScan next = std::move(pending_.front());
    pending_.pop_front();
    process(next.scan, next.end, out);
  }
  propagate(*estimate_, s.t);
  keep_finite();
  // Without sweeps nothing older than this will be replayed.
  constexpr Duration longest_replay = std::chrono::seconds(2);
  if (s.t - anchor_.t > longest_replay && pending_.empty()) settle(*estimate_);
  out.push_back(output_now());
}

void Estimator::settle(const Estimate& e) {
  anchor_ = e;
  while (imu_.size() > 2 && imu_[1].t <= anchor_.t) imu_.pop_front();
}

bool Estimator::keep_finite() {
  if (is_finite(*estimate_)) return true;
  // Back to the last good state; where the robot went since, nobody knows.
  const Time t = estimate_->t;
  anchor_.t = t;
  anchor_.x.v.setZero();
  anchor_.P.diagonal().segment<3>(at::v).array() += 1.0;
  anchor_.P.diagonal().segment<6>(at::R).array() += 0.01;
  estimate_ = anchor_;
  ++statistics_.rollbacks;
  trajectory_.clear();
  trajectory_.push(t, estimate_->x.pose(), estimate_->x.v);
  return false;
}

Output Estimator::output_now() const {
  Output o;
  o.t = estimate_->t;
  o.x = estimate_->x;
  o.P = estimate_->P;
  o.P.topLeftCorner<6, 6>() += map_error_.at(estimate_->x.pose());
  o.modality = used_[static_cast<std::size_t>(Sensor::lidar)] ? Modality::li : Modality::coast;
  return o;
}

void Estimator::process(const LidarScan& scan, Time end, std::vector<Output>& out) {
  if (end < anchor_.t) return drop(Sensor::lidar, "before the state");
  Stopwatch watch;
  // The state is updated at the middle of the sweep: half of the points are older, half are younger, so what the IMU gets wrong within
  // the sweep cancels to first order. What came since is replayed.
  const Time centre = std::max(anchor_.t, end - (end - begin_of(scan)) / 2);
  Estimate prior = anchor_;
  propagate(prior, centre);
  Estimate ahead = prior;
  propagate(ahead, end);
  const std::vector<PointXYZI> points = undistort(scan, trajectory_, centre, robot_.lidar, statistics_.points);
  const std::vector<PointCluster> clusters = downsample(points, prior.x.pose(), config_.lidar.voxel_size, config_.lidar.reach());
  const Eigen::Vector3d p_IL = robot_.lidar.T_imu_lidar.p;
  LidarConfig lidar = config_.lidar;
  // With hysteresis: each change of mind would hand what was drifted since to the map.
  constexpr double to_leave = 3.0;
  if (degenerate_) lidar.weak_share *= to_leave;
  LidarModel model(map_, clusters, p_IL, map_error_.at(prior.x.pose()), lidar, workers_);
  const PoseCovariance within_scan = undistortion_noise(config_.noise, end - centre);
  const auto measured = [&](const State& x, const Covariance& P) {
    Information<6> info = model(x, P);
    add_common_noise(within_scan, info);
    return info;
  };
  estimate_ = map_.empty() ? prior : update(prior, measured, config_.update).posterior;
  const bool good = keep_finite();
  StageTimes stages;
  stages.lidar_us = watch.lap_us();

  const SE3 T_WI = estimate_->x.pose();
  if (good) {
    trajectory_.correct(centre, T_WI, estimate_->x.v - prior.x.v);
    map_error_.registered(T_WI, model.by_epoch(), weak_part(model.report().degeneracy));
    const std::uint32_t epoch = map_error_.epoch_now(T_WI, estimate_->P.topLeftCorner<6, 6>());
    map_.insert(to_world(clusters, T_WI, p_IL, config_.lidar), epoch);
    map_.forget(estimate_->x.p);
    degenerate_ = model.report().degeneracy.weak_count > 0;
    settle(*estimate_);
  }
  stages.map_us = watch.lap_us();

  propagate(*estimate_, end);
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::lidar)].used;
  statistics_.diverged = statistics_.diverged || estimate_->x.v.norm() > absurd_speed;
  Output o = output_now();
  o.is_sweep = true;
  o.registration = model.report();
  o.points_W = in_world(points, T_WI);
  o.stages = stages;
  o.stages.other_us = watch.lap_us();
  out.push_back(std::move(o));
}

}  // namespace kilvo
