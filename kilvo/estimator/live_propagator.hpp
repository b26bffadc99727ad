// The asynchronous phase by itself, ahead of the estimator: what the IMU and the legs say at once, on top of a state that a sweep or an
// image still waits to correct. A value that the estimator fills (Estimator::fork) and that then goes on alone, until the next one.
// docs/decisions/2026-11-21-the-fast-thread-runs-ahead.md says why.
#pragma once

#include <optional>

#include "kilvo/estimator/clipping.hpp"
#include "kilvo/estimator/output.hpp"
#include "kilvo/estimator/replay.hpp"
#include "kilvo/legs/contact_detector.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "kilvo/legs/stance_tracker.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class LivePropagator {
 public:
  LivePropagator(const Robot& robot, const EstimatorConfig& config);

  /// Each takes a measurement in the order of its arrival and says whether there is a new output. One that it knows already, that is late,
  /// or that is too far ahead to be believed is ignored: the estimator sees it as well. Neither allocates, once warm.
  bool push(const ImuSample& s);
  bool push(const Feet& feet);

  /// By how much the leg samples' stamps trail the IMU's as they arrive: for so long the IMU alone carries no outputs.
  void expect_legs_after(Duration lag) { lag_ = lag; }

  /// Of the newest state; its time never goes back within one value, but may against another's.
  Output output() const;

  std::uint32_t epoch() const { return epoch_; }
  bool started() const { return started_; }
  /// The IMU is silent: no pose until it is back.
  bool imu_lost() const { return imu_lost_; }
  /// Measurements of earlier stamps are of no use to it.
  Time known() const { return closed_.t; }

 private:
  friend class Estimator;  // fills it
  void close(Time until);
  void miss_legs();
  bool keep_finite();

  // Of the robot, never changed:
  double leg_rate_, imu_rate_;

  // From the estimator:
  bool started_ = false, imu_lost_ = false;
  double accel_scale_ = 1;
  Estimate closed_;  // at an IMU sample
  Estimate now_;     // at the newest measurement
  Replay replay_;    // from closed_ on
  ContactDetector contacts_;
  StanceTracker stances_;
  ClippingDetector clipping_;
  std::optional<Time> last_legs_;  // while the legs are used
  double leg_period_ = 0;          // s
  std::uint32_t epoch_ = 0;
  Modality modality_ = Modality::coast;
  Reason cause_ = Reason::start;
  PoseCovariance map_error_ = PoseCovariance::Zero();

  Duration lag_{};                            // see expect_legs_after
  bool with_legs_ = false;                    // the newest output is of a leg sample
  double kinematic_us_ = 0, contact_us_ = 0;  // what that took
};

}  // namespace kilvo
