// The estimate over time: a base, after the last sweep or image (or an IMU sample when none came for long), and the IMU samples and leg
// updates since then. A sweep that corrects its own time replaces the base, and all that came since is propagated again (Replay).
#pragma once

#include <array>
#include <optional>
#include <utility>

#include "kilvo/estimator/replay.hpp"
#include "kilvo/filter/trajectory.hpp"

namespace kilvo {

class History {
 public:
  explicit History(const EstimatorConfig& config);

  /// The first estimate. `rest_until`: see Replay::began_at_rest.
  void begin(const Estimate& first, std::optional<Time> rest_until);
  bool has_begun() const { return begun_; }

  /// At the newest measurement.
  const Estimate& now() const { return now_; }
  /// At the newest IMU sample, with both ends of all intervals before it.
  const Estimate& closed() const { return closed_; }
  /// After the last sweep or image, at its time. Nothing before it is known any more.
  const Estimate& base() const { return base_; }
  /// The IMU samples and leg updates since the base.
  const Replay& replay() const { return replay_; }
  /// The poses of the last half second.
  const Trajectory& trajectory() const { return trajectory_; }

  /// The estimate of a time not before the base. The poses up to then are in the trajectory.
  Estimate at(Time t) { return record_from(base_, t); }
  /// For a sweep until `end`: a history that does not trust the accelerometer since the base, nor the gyro if the robot is to have turned
  /// at `rate`, rad/s, instead. None when that is too long ago. now() and closed() stay.
  std::optional<History> doubted(Time end, const std::optional<Eigen::Vector3d>& rate) const;
  /// A history in which the robot is elsewhere at the base, with its feet, up to standard deviations in rad and m. now() and closed() stay.
  History moved(const SE3& by, double turned, double moved) const;
  /// A history in which the pose that is predicted from the last sweep to `middle` may be off by so much, rad and m, and the rates since
  /// then with it; if `biases` are doubted, those of the IMU too. None when that sweep is over 1.5 s ago. now() and closed() stay.
  std::optional<History> loosened(Time middle, double turned, double moved, bool biases) const;
  /// The estimate at `until` if it was `e` before. The poses in between are in the trajectory.
  Estimate record_from(const Estimate& e, Time until);
  /// Poses of the trajectory at `t` and at the base; the same twice when `t` is not before the base, none when it is too long before.
  struct Motion {
    SE3 begin, end;
  };
  std::optional<Motion> motion_since(Time t) const;

  /// Only keeps the sample; close() takes the estimate there.
  void add(const ImuSample& s) { replay_.add(s); }
  /// Brings the estimate to the IMU sample at `t`: both ends of the interval are known now.
  void close(Time t);

  /// What close() took since the last call, us.
  double take_closing_us() { return std::exchange(closing_us_, 0); }

  /// Carries now() on to `t`, of a leg sample, with the newest IMU sample held.
  void predict_to(Time t) { replay_.predict_to(now_, t, nullptr); }
  /// Carries now() on to `t`, with the leg updates until then.
  void advance_to(Time t) { replay_.advance(now_, t, record()); }
  /// A leg update of now()'s time. Returns which feet were used and not refused.
  std::array<bool, 2> take(const LegStep& step) { return replay_.take(now_, step); }
  /// After take(): a leg sample of the base's or the newest IMU sample's own time belongs before the interval that begins there.
  void settle_leg_update();
  /// From `t` on no foot stands.
  void end_stances(Time t);

  /// now() is as at the newest IMU sample again: what comes next corrects the past.
  void drop_leg_updates_ahead() { now_ = closed_; }
  /// The estimate goes on from `e`, which has not become the base.
  void resume(const Estimate& e) { now_ = closed_ = e; }
  /// `e`, not before the base, is the base from now on, and the estimate goes on from there.
  void rebase(const Estimate& e);
  /// The estimate of the newest IMU sample is the base from now on.
  void rebase_to_closed();
  /// The pose at the time of `e` is that of `e`, its velocity has changed by `dv_W`: relative motion before stays what it was.
  void correct_trajectory(const Estimate& e, const Eigen::Vector3d& dv_W) { trajectory_.correct(e.t, e.x.pose(), dv_W); }
  /// A sweep until `end` took `prior` to `posterior`, of its middle: see Replay::correlate_with_sweep and,
  /// where no legs have moved the velocity (`without_legs`), learn_accel_noise; `open`: it left a direction open.
  void correlate_with_sweep(Time end, const Estimate& prior, const Estimate& posterior, bool without_legs, bool open);
  /// Adds the square of this standard deviation to the velocity's variance, m/s.
  void inflate_velocity(double sigma);

  /// The estimate of the newest IMU sample is one to go back to.
  void remember_good() { good_ = closed_; }
  /// now() was not plausible: back to the last good estimate, with its covariance inflated over the time since. Returns that time, s.
  double roll_back();

  /// For the live propagator: becomes what is needed to go on from the newest IMU sample of `other`. A fork has no base and no trajectory:
  /// only now(), closed(), add(), predict_to(), take(), settle_leg_update() and close_fork() are for it. Allocates only to grow.
  void fork_from(const History& other);
  /// Of a fork: closes the intervals up to the newest IMU sample not after `until`, forgets what came before. `legs`: the newest, if any.
  void close_fork(Time until, std::optional<Time> legs);

 private:
  static constexpr Duration longest_correction = std::chrono::milliseconds(300);  // of what is past
  static constexpr double longest_doubt = 1.5;                                    // s, since the last sweep

  Trajectory* record() { return is_fork_ ? nullptr : &trajectory_; }

  Replay replay_;
  Estimate base_, closed_, now_;
  Estimate good_;              // the last plausible closed_
  std::optional<Time> swept_;  // middle of the last one that correlate_with_sweep() was given
  Trajectory trajectory_;
  double closing_us_ = 0;
  bool begun_ = false, is_fork_ = false;
};

}  // namespace kilvo
