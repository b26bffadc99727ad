// The first estimate: gravity, gyro bias and the unit of the accelerometer from a robot that stands still; failing that, a moving start.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kilvo/estimator/config.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// No gyro has a larger bias, or one that changes by more, rad/s.
inline constexpr double largest_gyro_bias = 0.1;

struct Start {
  Estimate estimate;               // at the first sample of the still window, or at the last sample of a moving start
  std::optional<Time> rest_until;  // the last sample of the still window
  double accel_scale = 1;          // from the IMU's unit to m/s^2
  bool still = true;
  double resting_norm = 0;  // of the accelerometer, in its own unit
};

class Initialiser {
 public:
  /// `accel_noise`: density of the accelerometer's noise, m/s^2/sqrt(Hz).
  Initialiser(const InitialConfig& config, bool gravity_align, double accel_noise)
      : config_(config), gravity_align_(gravity_align), accel_noise_(accel_noise) {}

  /// Returns the start as soon as it is known. Samples must be finite and in time order.
  std::optional<Start> add(const ImuSample& s);

  std::string waiting_for() const;

 private:
  Start start(bool still) const;

  InitialConfig config_;
  bool gravity_align_;
  double accel_noise_;
  std::deque<ImuSample> window_;  // of still_time
  std::deque<ImuSample> moving_;  // of moving_start
  std::optional<Time> first_;
};

/// Keeps the measurements that come before the first estimate.
class Starter {
 public:
  explicit Starter(const EstimatorConfig& config)
      : initialiser_(config.initial, config.gravity_align, config.noise.accel),
        moving_start_(config.initial.moving_start),
        still_time_(from_seconds(config.initial.still_time)) {}

  /// In time order. Returns the start as soon as it is known.
  std::optional<Start> add(Measurement m);

  /// What was kept, in time order.
  std::deque<Measurement> take_kept() { return std::exchange(kept_, {}); }
  /// Sensors of the measurements that were not kept since the last call.
  std::vector<Sensor> take_dropped() { return std::exchange(dropped_, {}); }

  std::string waiting_for() const { return initialiser_.waiting_for(); }

 private:
  void bound_images();

  Initialiser initialiser_;
  double moving_start_;  // s
  Duration still_time_;
  std::deque<Measurement> kept_;
  std::vector<Sensor> dropped_;
};

/// R_WI with z of the world along `up_I`, x along the horizontal part of the IMU's x axis (of y where x is within 10 degrees of vertical).
SO3 level(const Eigen::Vector3d& up_I);

}  // namespace kilvo
