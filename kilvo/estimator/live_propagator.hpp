// The asynchronous phase by itself, ahead of an estimator that still works on a sweep or an image (docs/decisions/live.md). It starts from
// the estimator's state (Estimator::fork) and runs the same History and LegPipeline.
#pragma once

#include "kilvo/estimator/history.hpp"
#include "kilvo/estimator/imu_watch.hpp"
#include "kilvo/estimator/output.hpp"
#include "kilvo/estimator/sensor_status.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "kilvo/legs/leg_pipeline.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class LivePropagator {
 public:
  LivePropagator(const Robot& robot, const EstimatorConfig& config);

  /// Each takes a measurement in the order of arrival and returns whether there is a new output. One that is known, late or too far ahead
  /// is ignored: the estimator sees it as well. Neither allocates, once warm.
  bool push(const ImuSample& s);
  bool push(const Feet& feet);

  /// By how much the leg samples' stamps trail the IMU's as they arrive: for so long the IMU alone carries no outputs.
  void expect_legs_after(Duration lag) { lag_ = lag; }

  /// Of the newest state; its time never goes back within one value, but may against another's.
  Output output() const;

  std::uint32_t epoch() const { return epoch_; }
  bool started() const { return started_; }
  /// The IMU is silent: no pose until it is back.
  bool imu_lost() const { return status_.imu_lost(); }
  /// Measurements of earlier stamps are of no use to it.
  Time known() const { return history_.closed().t; }

  /// Goes on from the estimator's present state; `common_error`: what its covariance lacks. Allocates only when it never held so much.
  void become(const History& history, const LegPipeline& legs, const ImuWatch& imu, const SensorStatus& status,
              const PoseCovariance& common_error, std::uint32_t epoch);

 private:
  bool keep_finite();

  bool started_ = false;
  History history_;
  LegPipeline legs_;
  ImuWatch imu_;
  SensorStatus status_;
  PoseCovariance common_error_ = PoseCovariance::Zero();
  std::uint32_t epoch_ = 0;
  Duration lag_{};                            // see expect_legs_after
  bool with_legs_ = false;                    // the newest output is of a leg sample
  double kinematic_us_ = 0, contact_us_ = 0;  // what that took
};

}  // namespace kilvo
