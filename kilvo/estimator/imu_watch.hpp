// Checks of the IMU's samples before they are integrated: unit, plausibility, clipping, standstill.
#pragma once

#include <optional>

#include "kilvo/estimator/clipping.hpp"
#include "kilvo/estimator/config.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/filter/stationarity.hpp"
#include "kilvo/sensors/reason.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class ImuWatch {
 public:
  ImuWatch(const ImuMount& mount, const InitialConfig& config);

  /// Accelerations are `scale` times the samples' values, in m/s^2.
  void set_scale(double scale) { accel_scale_ = scale; }

  /// Converts a sample to m/s^2 and marks what is clipped. Returns why it must not be used.
  std::optional<Reason> prepare(ImuSample& s);
  /// A sample that is used, and the estimated gyro bias.
  void add(const ImuSample& s, const Eigen::Vector3d& gyro_bias) { stationarity_.add(s, gyro_bias); }
  /// The IMU was silent.
  void restart() { stationarity_.restart(); }

  /// The acceleration has been usual for 20 ms: no impact.
  bool is_calm(Time t) const { return stationarity_.is_usual(t, std::chrono::milliseconds(20)); }

  /// Without another sensor: the estimate after a zero-velocity update, if the robot is at rest at `s` and the last one is long ago enough.
  std::optional<Estimate> zero_velocity_update(const Estimate& e, const ImuSample& s, const UpdateConfig& config);

 private:
  double accel_scale_ = 1, absurd_accel_;  // -, m/s^2
  ClippingDetector clipping_;
  double velocity_sigma_;  // at rest, m/s
  StationarityDetector stationarity_;
  std::optional<Time> last_update_;  // by standing still
};

}  // namespace kilvo
