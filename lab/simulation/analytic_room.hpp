// A room whose truth is a formula: a box with boxes in it, and a sensor head on a smooth path through it. Gives IMU samples and LiDAR
// scans with known noise and the exact pose at any time: what the demo walks through and what tests judge against.
#pragma once

#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/measurement_source.hpp"

namespace kilvo::lab {

struct AnalyticRoomConfig {
  std::uint64_t seed = 1;
  double duration = 20;  // s
  double still = 1.5;    // s, standing at the start
  enum class Path { loop, straight } path = Path::loop;
  double imu_rate = 200;                                // Hz
  double gyro_noise = 2e-4;                             // rad/s/sqrt(Hz)
  double accel_noise = 1.5e-3;                          // m/s^2/sqrt(Hz)
  Eigen::Vector3d gyro_bias = {0.002, -0.001, 0.0015};  // rad/s
  Eigen::Vector3d accel_bias = {0.02, -0.03, 0.01};     // m/s^2
  double scan_rate = 10;                                // Hz
  int points_per_scan = 20000;
  double range_noise = 0.02;   // m
  double angle_noise = 0.001;  // rad
  double max_range = 60;       // m
  SE3 T_imu_lidar = {SO3(), {-0.011, -0.02329, 0.04412}};
};

/// A rectangle: corner + a * u + b * v for a, b in [0, 1].
struct Rectangle {
  Eigen::Vector3d corner, u, v;
  Eigen::Vector3d normal() const { return u.cross(v).normalized(); }
};

class AnalyticRoom : public MeasurementSource {
 public:
  explicit AnalyticRoom(const AnalyticRoomConfig& config);

  /// In order of arrival: a scan after its last point.
  std::optional<Measurement> next() override;

  /// Pose of the IMU in the room at `t`, exact.
  SE3 truth(Time t) const;
  Eigen::Vector3d velocity(Time t) const;  // in the room, m/s
  Time start() const { return start_; }
  const std::vector<Rectangle>& surfaces() const { return surfaces_; }

 private:
  double seconds_of(Time t) const { return to_seconds(t - start_); }
  SE3 pose_at(double s) const;
  ImuSample imu_at(double s);
  LidarScan scan_at(double s);
  double range_to_surface(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  Eigen::Vector3d gaussian();

  AnalyticRoomConfig config_;
  Time start_;
  std::mt19937_64 random_;
  std::vector<Rectangle> surfaces_;
  std::int64_t imu_index_ = 0, scan_index_ = 0;
};

/// The exact gravity of this room, m/s^2.
inline constexpr double analytic_gravity = 9.80665;

}  // namespace kilvo::lab
