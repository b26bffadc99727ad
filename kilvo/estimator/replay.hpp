// The IMU samples and leg updates since a time, and the propagation of an estimate of that time to a later one: the same code for the first
// propagation and for the re-propagation after a sweep has corrected the earlier estimate.
#pragma once

#include <optional>
#include <vector>

#include "kilvo/estimator/config.hpp"
#include "kilvo/estimator/recent.hpp"
#include "kilvo/filter/gain.hpp"
#include "kilvo/filter/trajectory.hpp"
#include "kilvo/legs/leg_measurements.hpp"

namespace kilvo {

class Replay {
 public:
  explicit Replay(const EstimatorConfig& config) : config_(config) {
    remembered_.reserve(most_remembered);
    taken_.reserve(most_taken);
  }

  /// In time order, each kind by itself.
  void add(const ImuSample& s);
  void add(const LegStep& s) { steps_.push_back(s); }

  /// The IMU was silent within [begin, end], for so long that nothing is known of the motion.
  bool is_blind(Time begin, Time end) const;
  /// The noise of the settings, with that of the gyroscope as large as gaps, clipping and jumps within [begin, end] make it.
  ProcessNoise noise_within(Time begin, Time end) const;

  /// The angular rate as measured, rad/s; none within a gap.
  std::optional<Eigen::Vector3d> gyro_at(Time t) const;

  /// The IMU's measurement at `t`: interpolated between two samples, or the last one held.
  ImuSample imu_at(Time t) const;

  /// Density of the accelerometer's noise as it is taken, m/s^2/sqrt(Hz): that of the settings, or more when the samples show it.
  double accel_noise() const { return noise_now().accel; }

  /// All that are remembered.
  std::vector<ImuSample> samples() const { return {imu_.begin(), imu_.end()}; }
  bool has_imu() const { return !imu_.empty(); }
  const ImuSample& newest_imu() const { return imu_.back(); }
  /// The stamp of the newest IMU sample that is not after t; before all times when there is none.
  Time newest_imu_by(Time t) const;

  /// Predicts e to `until`, applying the leg updates after e.t. Between IMU samples with both of them, after the newest one with
  /// that held. Every state goes into `record`, if there is one.
  void advance(Estimate& e, Time until, Trajectory* record) const;

  /// Predicts e to `until` without looking at the legs.
  void predict_to(Estimate& e, Time until, Trajectory* record) const;

  /// Adds a leg step and applies it to e, which must be of its time. Returns which feet of it were used and not refused.
  std::array<bool, 2> take(Estimate& e, const LegStep& step);

  /// Brings `closed`, of the time of an IMU sample, to that of a later one: as advance() does, at a third of the cost when `live` was
  /// propagated with the first sample held and has the leg updates. The mean is propagated again with both samples and the stored gains;
  /// the covariance, which they barely change, is that of `live`.
  void close(Estimate& closed, const Estimate& live, Time until, Trajectory* record);

  /// A sweep until `end` has been used with points that the IMU's motion took to its middle: their information about the pose contains
  /// these shares of the IMU's error in rotation and in position until then.
  void correlate_with_sweep(Time end, double rotation, double position) { sweep_noise_ = {end, rotation, position}; }

  /// A sweep changed the velocity by so much, squared, per variance of what it was to change it by. The noise that is learnt counts where
  /// the accelerometer aliases, or where sweeps leave a direction `open`: what they measure they tell of themselves.
  void learn_accel_noise(double normalised, bool open = false);

  /// The robot stood still until `end`, if it did, and the first biases are the means of the IMU's samples until then.
  void began_at_rest(std::optional<Time> end) { rest_until_ = end; }

  /// `e` came from the oldest estimate that will be replayed by advance(): a propagation to a later time may start there instead.
  void remember(const Estimate& e);
  /// The last estimate remembered that is not later than `t`, else `oldest`.
  const Estimate& nearest(Time t, const Estimate& oldest) const;

  /// Samples after `base` are not used: the accelerometer's are replaced by gravity, the gyro's by a `rate`, rad/s, if any, all as clipped.
  void doubt_samples(const Estimate& base, const std::optional<Eigen::Vector3d>& rate);
  /// Of the last seconds, rad/s.
  const Eigen::Vector3d& mean_gyro() const { return usual_.gyro_mean; }

  /// The oldest estimate that will be replayed has changed.
  void forget_estimates() {
    remembered_.clear();
    taken_.clear();
  }

  /// What is not needed by estimates of `t` and later; nothing that was remembered, for `t` has another estimate now.
  void forget_before(Time t);
  /// Becomes what `other` still knows that estimates of `t` and later need. Allocates only when it has never held so much.
  void copy_since(Time t, const Replay& other);
  void clear_steps() {
    steps_.clear();
    forget_estimates();
  }

 private:
  static constexpr std::size_t most_remembered = 100, most_taken = 12;
  // How a step was taken since the last close.
  struct Taken {
    Time t{};
    LegModel::Used used;
    Gain<LegModel::max_leg_rows> gain;
  };

  LegModel::Used apply(Estimate& e, const LegStep& step, Gain<LegModel::max_leg_rows>* kept = nullptr) const;
  bool retrace(Estimate& e, const Estimate& live, Time until, Trajectory* record) const;
  void inflate_for_faults(ImuInterval& interval, const ImuSample& a, const ImuSample& b) const;
  void inflate_for_missed(ImuInterval& interval, double gap) const;
  ImuInterval interval_between(const ImuSample& a, const ImuSample& b, Time begin, Time end, const State& x) const;
  StandingFeet standing_at(Time t) const;
  double longest_gap() const;  // between IMU samples, s
  ProcessNoise noise_now() const;
  double expected_density2() const;  // of the accelerometer's second differences, by the settings
  bool aliases() const { return usual_.accel_density2 > 1.5 * expected_density2(); }
  bool uses_learnt_noise() const { return usual_.open || aliases(); }

  struct SweepNoiseCorrelation {
    Time until{};
    double rotation = 0, position = 0;
  };

  EstimatorConfig config_;
  SweepNoiseCorrelation sweep_noise_;
  std::optional<Time> rest_until_;
  Recent<ImuSample> imu_;
  Recent<LegStep> steps_;
  std::vector<Estimate> remembered_;
  std::vector<Taken> taken_;
  // Of the last seconds of the IMU.
  struct Usual {
    double period = 0;  // s, of samples that follow each other
    Eigen::Vector3d gyro_mean = Eigen::Vector3d::Zero(), accel_mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d gyro_variance = Eigen::Vector3d::Zero(), accel_variance = Eigen::Vector3d::Zero();
    double gyro_density2 = 0, accel_density2 = 0;  // of the noise that second differences show, if it were white: (rad/s)^2 s, (m/s^2)^2 s
    double gyro_bend2 = 0, accel_bend2 = 0;        // how far a sample lay beside the line between its neighbours at the most, squared
    double accel_scale = 1;                        // of the accelerometer's noise, as sweeps show it
    bool open = false;                             // see learn_accel_noise()
  };
  void note_usual(const ImuSample& s);

  Usual usual_;
};

}  // namespace kilvo
