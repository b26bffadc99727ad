#include "kilvo/estimator/estimator.hpp"

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
      map_(config.map) {
  if (!used[static_cast<std::size_t>(Sensor::imu)]) throw std::invalid_argument("the IMU is needed: nothing is estimated without it");
  if (config.lidar.voxel_size > map_.leaf_size() * (1 + 1e-9)) throw std::invalid_argument("lidar.voxel_size must be at most a quarter of map.voxel_size");
}

std::vector<Output> Estimator::push(Measurement m) {
  std::vector<Output> out;
  const Sensor s = sensor_of(m);
  if (!used_[static_cast<std::size_t>(s)]) {
    drop(s, "not used");
    return out;
  }
  if (const auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && !(imu->gyro.allFinite() && imu->accel.allFinite())) {
    drop(s, "not finite");
    return out;
  }
  if (const auto* scan = std::get_if<LidarScan>(&m); scan != nullptr && scan->points.empty()) {
    drop(s, "empty");
    return out;
  }
  if (const auto refused = timeline_.push(std::move(m))) {
    drop(s, *refused);
    return out;
  }
  while (auto next = timeline_.pop()) handle(*next, out);
  return out;
}

std::vector<Output> Estimator::finish() {
  std::vector<Output> out;
  timeline_.end();
  while (auto next = timeline_.pop()) handle(*next, out);
  // A scan that ends between the last IMU sample and where the next would have been: the last sample is held.
  const Duration period = from_seconds(1.5 / robot_.imu.rate);
  while (estimate_ && last_imu_ && !pending_.empty() && pending_.front().end <= last_imu_->t + period) {
    PendingScan next = std::move(pending_.front());
    pending_.pop_front();
    ImuSample held = *last_imu_;
    held.t = next.end;
    advance(*last_imu_, held, next.end);
    process(std::move(next.scan), next.end, out);
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
  estimate_ = good_ = start.estimate;
  trajectory_.push(estimate_->t, estimate_->x.pose(), estimate_->x.v);
  if (!start.still) statistics_.warnings.push_back("the robot did not stand still: started on the move, with wide uncertainties");
  const double norm = start.resting_norm * start.accel_scale;
  if (std::abs(norm - standard_gravity) > 0.1 * standard_gravity) {
    statistics_.warnings.push_back("the accelerometer measured " + std::to_string(start.resting_norm) + " at the start: neither 9.8 m/s^2 nor 1 g");
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

void Estimator::advance(const ImuSample& from, const ImuSample& to, Time until) {
  ImuInterval interval = ImuInterval::between(from, to, estimate_->t, until);
  const double gap = to_seconds(to.t - from.t);
  if (gap > config_.max_imu_gap) {
    // Nobody saw the motion. White acceleration of a few m/s^2 over the gap, as a density, and no trust in the two samples.
    constexpr double unknown_accel = 3.0;  // m/s^2
    const double density2 = unknown_accel * unknown_accel * gap;
    interval.noise_scale = density2 / (config_.noise.accel * config_.noise.accel);
    if (gap > 1.0) {
      interval.gyro_begin = interval.gyro_end = estimate_->x.bg;
      interval.accel_begin = interval.accel_end = estimate_->x.ba - estimate_->x.R.matrix().transpose() * estimate_->x.g;
      estimate_->x.v.setZero();
    }
  }
  estimate_ = predict(*estimate_, interval, {}, config_.noise);
  trajectory_.push(estimate_->t, estimate_->x.pose(), estimate_->x.v);
}

void Estimator::handle_imu(ImuSample s, std::vector<Output>& out) {
  s.accel *= accel_scale_;
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::imu)].used;
  if (!last_imu_) {
    last_imu_ = s;
    if (s.t < estimate_->t) return;
  }
  while (!pending_.empty() && pending_.front().end <= s.t) {
    PendingScan next = std::move(pending_.front());
    pending_.pop_front();
    if (next.end < estimate_->t) {
      drop(Sensor::lidar, "before the state");
      continue;
    }
    advance(*last_imu_, s, next.end);
    process(std::move(next.scan), next.end, out);
  }
  if (s.t > estimate_->t) advance(*last_imu_, s, s.t);
  last_imu_ = s;
  keep_finite();
  out.push_back(output_now());
}

bool Estimator::keep_finite() {
  if (is_finite(*estimate_)) return true;
  const Time t = estimate_->t;
  estimate_ = good_;
  estimate_->t = t;
  estimate_->x.v.setZero();
  estimate_->P.diagonal().segment<3>(at::v).array() += 1.0;
  estimate_->P.diagonal().segment<6>(at::R).array() += 0.01;
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
  o.modality = used_[static_cast<std::size_t>(Sensor::lidar)] ? Modality::li : Modality::coast;
  return o;
}

void Estimator::process(LidarScan scan, Time end, std::vector<Output>& out) {
  Stopwatch watch;
  const std::vector<PointXYZI> points = undistort(scan, trajectory_, end, robot_.lidar, statistics_.points);
  const std::vector<PointCluster> clusters = downsample(points, estimate_->x.pose(), config_.lidar.voxel_size);
  const Eigen::Vector3d p_IL = robot_.lidar.T_imu_lidar.p;
  LidarModel model(map_, clusters, p_IL, config_.lidar);
  if (!map_.empty()) estimate_ = update(*estimate_, model, config_.update).posterior;
  const bool good = keep_finite();
  StageTimes stages;
  stages.lidar_us = watch.lap_us();

  if (good) {
    trajectory_.correct(estimate_->x.pose(), estimate_->x.v);
    map_.insert(to_world(clusters, estimate_->x.pose(), p_IL, config_.lidar));
    map_.forget(estimate_->x.p);
    good_ = *estimate_;
  }
  stages.map_us = watch.lap_us();

  ++statistics_.sensors[static_cast<std::size_t>(Sensor::lidar)].used;
  statistics_.diverged = statistics_.diverged || estimate_->x.v.norm() > absurd_speed;
  Output o = output_now();
  o.is_sweep = true;
  o.registration = model.report();
  o.points_W = in_world(points, estimate_->x.pose());
  o.stages = stages;
  o.stages.other_us = watch.lap_us();
  out.push_back(std::move(o));
}

}  // namespace kilvo
