#include "lab/simulation/simulator.hpp"

#include <cmath>
#include <utility>

#include "lab/simulation/clutter.hpp"
#include "lab/simulation/joint_effort.hpp"

namespace kilvo::lab {
namespace {

// What the configuration leaves to the model of the wear.
SimulatorConfig worn(SimulatorConfig config) {
  config.shape = built(config.shape, config.wear, config.seed);
  if (config.wear.zero_offset > 0) config.joints.offset_sigma = config.wear.zero_offset;
  return config;
}

enum SimulatorStream : std::uint8_t { bias_stream = 1, offset_stream = 2, sensor_stream = 10 };

Ground ground_of(const Scenario& scenario, std::uint64_t seed) { return make_scene(scenario.world, seed).ground; }

}  // namespace

Simulator::Simulator(const Scenario& scenario, const SimulatorConfig& config)
    : config_(worn(config)),
      walk_(config_.shape, ground_of(scenario, config.seed), scenario.start, on_soft_soles(scenario.stages, config.wear)),
      wear_(config.wear, walk_, config.seed),
      world_(cluttered(make_scene(scenario.world, config.seed), walk_, config.errors.objects, config.seed), config.seed),
      lidar_(config_, world_, scenario.lidar_range),
      camera_(config_, world_),
      workers_(config.threads),
      start_(time_from_ns(1'700'000'000'000'000'000)),
      duration_(config.duration > 0 ? config.duration : walk_.end()) {
  Random random(config.seed, bias_stream);
  gyro_bias_ = config.imu.gyro_bias_sigma * random.gaussian3();
  accel_bias_ = config.imu.accel_bias_sigma * random.gaussian3();
  Random offsets(config.seed, offset_stream);
  for (double& offset : joint_offsets_) offset = config_.joints.offset_sigma * offsets.gaussian();
  for (std::size_t i = 0; i < sensor_count; ++i) {
    random_.emplace_back(config.seed, sensor_stream, i);
    if (config.use[i]) schedule(static_cast<Sensor>(i), 0);
  }
}

const Delivery& Simulator::delivery(Sensor sensor) const {
  switch (sensor) {
    case Sensor::imu:
      return config_.imu.delivery;
    case Sensor::legs:
      return config_.joints.delivery;
    case Sensor::lidar:
      return config_.lidar.delivery;
    default:
      return config_.camera.delivery;
  }
}

void Simulator::schedule(Sensor sensor, std::int64_t index) {
  const Delivery& d = delivery(sensor);
  // A scan is complete after its last ray, an image when its shutter closes.
  const double lasts = sensor == Sensor::lidar ? 1 / d.rate : 0, t = static_cast<double>(index) / d.rate;
  if (t + lasts > duration_) return;
  due_.push({t + lasts + d.latency, sensor, index});
}

Time Simulator::stamp(Sensor sensor, double t) {
  const Delivery& d = delivery(sensor);
  const double jitter = d.jitter > 0 ? d.jitter * random_[index_of(sensor)].gaussian() : 0;
  return start_ + from_seconds(t + d.offset + jitter);
}

std::optional<Measurement> Simulator::next() {
  if (again_) return std::exchange(again_, std::nullopt);
  while (!due_.empty()) {
    const Due due = due_.top();
    due_.pop();
    schedule(due.sensor, due.index + 1);
    arrived_ = start_ + from_seconds(due.arrival);
    Measurement out = measure(due.sensor, due.index);
    const Copies copies = wear_.copies(due.sensor);
    if (copies == Copies::none) continue;
    if (copies == Copies::two) again_ = out;
    return out;
  }
  return std::nullopt;
}

Measurement Simulator::measure(Sensor sensor, std::int64_t index) {
  const double t = static_cast<double>(index) / delivery(sensor).rate;
  measured_ = start_ + from_seconds(t);
  const auto torso_at = [this](double x) { return walk_.torso(x); };
  switch (sensor) {
    case Sensor::imu:
      return imu_at(t);
    case Sensor::legs:
      return joints_at(t);
    case Sensor::lidar: {
      LidarScan scan = lidar_.scan(index, t, torso_at, workers_);
      scan.t = stamp(sensor, t);
      return scan;
    }
    default:
      return CameraImage{stamp(sensor, t), camera_.image(index, t, torso_at, workers_)};
  }
}

ImuSample Simulator::imu_at(double t) {
  const ImuModel& m = config_.imu;
  Random& random = random_[index_of(Sensor::imu)];
  const SE3 T_WI = walk_.imu(t);
  imu_truth_ = {start_ + from_seconds(t),
                walk_.angular_rate(t),
                T_WI.R.inverse() * (walk_.acceleration(t) + Eigen::Vector3d(0, 0, gravity)) + wear_.vibration(t),
                gyro_bias_,
                accel_bias_,
                walk_.velocity(t)};
  Eigen::Vector3d gyro = imu_truth_.gyro, accel = imu_truth_.accel;
  if (const auto& e = config_.errors.imu) {
    imu_truth_.gyro_bias += e->warmth(t) * e->gyro_warming;
    imu_truth_.accel_bias += e->warmth(t) * e->accel_warming;
    gyro = e->gyro * imu_truth_.gyro + e->g_sensitivity * imu_truth_.accel;
    accel = e->accel * imu_truth_.accel;
  }
  const double root_rate = std::sqrt(m.delivery.rate);
  const auto clipped = [](const Eigen::Vector3d& v, double range) { return Eigen::Vector3d(v.cwiseMax(-range).cwiseMin(range)); };
  ImuSample out;
  out.t = stamp(Sensor::imu, t);
  out.gyro = clipped(gyro + imu_truth_.gyro_bias + m.gyro_noise * root_rate * random.gaussian3(), m.gyro_range);
  out.accel = clipped(accel + imu_truth_.accel_bias + m.accel_noise * root_rate * random.gaussian3(), m.accel_range);
  gyro_bias_ += m.gyro_bias_walk / root_rate * random.gaussian3();
  accel_bias_ += m.accel_bias_walk / root_rate * random.gaussian3();
  return out;
}

JointSample Simulator::joints_at(double t) {
  const JointModel& m = config_.joints;
  Random& random = random_[index_of(Sensor::legs)];
  const JointAngles angles = walk_.joints(t), rates = walk_.joint_velocities(t), efforts = joint_efforts(walk_, t, m.mass);
  JointSample out;
  const Wear::Encoders shown = wear_.encoders(t, rates, efforts);
  out.t = wear_.joint_stamp(stamp(Sensor::legs, t));
  out.names = joint_names_;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double noisy = angles[i] + shown.angle[i] + joint_offsets_[i] + m.position_noise * random.gaussian();
    out.position.push_back(m.resolution > 0 ? std::round(noisy / m.resolution) * m.resolution : noisy);
    out.velocity.push_back(rates[i] + shown.velocity[i] + m.velocity_noise * random.gaussian());
    out.effort.push_back(efforts[i] + m.effort_noise * random.gaussian());
  }
  return out;
}

}  // namespace kilvo::lab
