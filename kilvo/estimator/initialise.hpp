// The first estimate: gravity, gyro bias and the unit of the accelerometer from a robot that stands still; failing that, a moving start.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "kilvo/estimator/config.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// A larger mean rate, or a bias that has changed by more, is of no gyro, rad/s.
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

  /// The start, as soon as there is one. Samples must be finite and in time order.
  std::optional<Start> add(const ImuSample& s);

  /// What it waits for, in words.
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

/// R_WI with z of the world along `up_I` and x along the horizontal part of the IMU's x axis (of its y axis when x is within 10 degrees
/// of the vertical).
SO3 level(const Eigen::Vector3d& up_I);

}  // namespace kilvo
