// The simulated robot: what its sensors say while it walks, in the order in which the messages arrive, and the truth.
#pragma once

#include <deque>
#include <queue>

#include "kilvo/sensors/measurement_source.hpp"
#include "lab/simulation/biped.hpp"
#include "lab/simulation/camera_sensor.hpp"
#include "lab/simulation/lidar_sensor.hpp"
#include "lab/simulation/random.hpp"
#include "lab/simulation/scenarios.hpp"
#include "lab/simulation/walk.hpp"
#include "lab/simulation/wear.hpp"

namespace kilvo::lab {

/// What an IMU without noise and bias would have said, and the biases that were added; one per IMU sample that next() gave.
struct ImuTruth {
  Time t;                                 // true time
  Eigen::Vector3d gyro, accel;            // rad/s, m/s^2, in the IMU frame
  Eigen::Vector3d gyro_bias, accel_bias;  // rad/s, m/s^2
  Eigen::Vector3d velocity;               // of the IMU in the world, m/s
};

class Simulator final : public MeasurementSource {
 public:
  /// The exact gravity of this world, m/s^2.
  static constexpr double gravity = 9.80665;

  /// Throws PlanError when the scenario's walk cannot be done.
  Simulator(const Scenario& scenario, const SimulatorConfig& config);
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  std::optional<Measurement> next() override;

  /// When the measurement that next() gave last arrived.
  Time arrived() const { return arrived_; }
  /// The true time at which it was measured: of a scan its first ray, of an image the middle of its exposure.
  Time measured() const { return measured_; }
  Time start() const { return start_; }
  double duration() const { return duration_; }  // s

  const Walk& walk() const { return walk_; }
  const World& world() const { return world_; }
  const SimulatorConfig& config() const { return config_; }
  /// Seconds of the walk at a true time.
  double seconds_of(Time t) const { return to_seconds(t - start_); }
  /// The truth of the IMU sample that next() gave last.
  const ImuTruth& imu_truth() const { return imu_truth_; }
  /// What each encoder shows more than the joint's angle, rad.
  const JointAngles& joint_zeros() const { return joint_offsets_; }

 private:
  struct Due {
    double arrival;  // s
    Sensor sensor;
    std::int64_t index;
    bool operator>(const Due& o) const { return std::pair(arrival, sensor) > std::pair(o.arrival, o.sensor); }
  };

  const Delivery& delivery(Sensor sensor) const;
  void schedule(Sensor sensor, std::int64_t index);
  /// What the sensor's clock says at second t.
  Time stamp(Sensor sensor, double t);
  Measurement measure(Sensor sensor, std::int64_t index);
  ImuSample imu_at(double t);
  JointSample joints_at(double t);

  SimulatorConfig config_;
  Walk walk_;
  Wear wear_;
  World world_;
  LidarSensor lidar_;
  CameraSensor camera_;
  Workers workers_;
  Time start_;
  double duration_;
  std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
  std::vector<Random> random_;  // by Sensor
  Eigen::Vector3d gyro_bias_, accel_bias_;
  JointAngles joint_offsets_{};
  JointNames joint_names_ = JointNames::List(joint_names().begin(), joint_names().end());
  Time arrived_{}, measured_{};
  std::optional<Measurement> again_;  // comes a second time
  ImuTruth imu_truth_{};
};

}  // namespace kilvo::lab
