// What has to be remembered of sensors that were away, and what a robot may have done while nobody looked.
#pragma once

#include <cstdint>
#include <optional>

#include "kilvo/estimator/config.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// After an IMU gap longer than this nothing is known of the motion in between but that it was a walking robot's, s.
inline constexpr double blind_gap = 0.1;

/// No foot of a robot that runs is off the ground for longer.
inline constexpr Duration longest_flight = std::chrono::milliseconds(500);

/// A velocity known to this gives a sweep its shape, and tells a standing foot from a moving one, m/s.
inline constexpr double known_velocity = 0.15;

/// Adds to the covariance what a walking robot may have done in the part [begin, end] of a gap.
void inflate_covariance_over_gap(Estimate& e, Time begin, Time end, double gap);

/// What the IMU alone says of the motion: whether it stands still, and how unusual the acceleration is now. No memory of samples, so
/// that it costs nothing.
class StationarityDetector {
 public:
  StationarityDetector(const InitialConfig& config, double theta) : config_(config), theta_(theta) {}

  void add(const ImuSample& s);
  void restart();
  /// The IMU has looked like one of a standing robot for at least half a second.
  bool stands() const { return quiet_blocks_ >= 2; }
  /// The mean rate while it stood, rad/s.
  const Eigen::Vector3d& resting_gyro() const { return resting_gyro_; }
  /// The acceleration has been a usual one for at least `hold`.
  bool is_usual(Time t, Duration hold) const { return usual_since_ && t - *usual_since_ >= hold; }

 private:
  void close_block();

  InitialConfig config_;
  double theta_;
  std::optional<Time> begin_, last_, usual_since_;
  double n_ = 0;
  Eigen::Vector3d gyro_ = Eigen::Vector3d::Zero(), gyro2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_ = Eigen::Vector3d::Zero(), accel2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d resting_gyro_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero(), variance_ = Eigen::Vector3d::Zero();
  int quiet_blocks_ = 0;
};

/// Of the estimator: what is on its way back.
struct Recovery {
  bool imu_lost = false;             // the last output said so
  std::optional<Time> legs_waiting;  // since when leg messages come again that are not used yet
  bool legs_were_there = false;
  int sweeps_to_go = 0;               // consistent sweeps before the map grows again
  std::optional<Time> refused_since;  // sweeps that fit nowhere
  std::optional<Time> last_standing;  // last update by standing still
};

}  // namespace kilvo
