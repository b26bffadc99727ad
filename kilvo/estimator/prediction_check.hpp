// Whether sweeps find the robot where the IMU predicted it. The filter's covariance knows the IMU's noise, not a bias that steps, a scale
// that is wrong or a clock that jumps: then it outvotes the sweeps, whose points are rejected one by one. Of what meets a surface the share
// that lies beside it hardly changes from sweep to sweep, whatever the place; where it rises, and another pose near by brings it back, the
// prediction was wrong. In a crowd no pose does.
#pragma once

#include "kilvo/lidar/lidar_pipeline.hpp"

namespace kilvo {

class PredictionCheck {
 public:
  /// It was registered much farther from `prior` than the covariance says and than sweeps usually are: the first one of its kind after some
  /// that were not, as after a push, or the next, which is none. `map_error`: of the map around the prior. To be asked once a sweep.
  enum class Surprise : std::uint8_t { none, first, again };
  Surprise surprise(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error);
  /// Of what meets a surface a tenth more than usual lies beside it.
  bool contradicts(const Registration& sweep) const;
  /// The prior from which the sweep is to be registered again: uncertain as far as the nearest planes are the right ones.
  static Estimate released(const Estimate& prior);
  /// `again`, the same sweep from another prior, lies on the surfaces as sweeps usually do.
  bool explains(const Registration& again, const Registration& sweep) const;

  /// How far a prediction may be off, beyond its covariance: standard deviations of each axis, rad and m.
  struct Error {
    double turned = 0, moved = 0;
  };
  static Error error_between(const State& predicted, const State& found);
  /// The prediction was off by this: those that follow may be as well.
  void begin(const Error& off);
  /// Of the predictions now, as the last sweeps show it; none while they are right.
  const std::optional<Error>& error() const { return error_; }
  /// That has lasted for some sweeps: a shock has passed by then, a bias has not. Once, and again when predictions contradict the sweeps.
  bool lasts() const { return error_ && sweeps_with_error_ == lasting; }

  /// Too often contradicted to be the IMU's: nothing is doubted any more.
  bool gives_up() const { return begun_ >= too_often; }
  /// That, or contradicted for `remembered` sweeps that the estimate is not to be used.
  bool is_hopeless() const { return gives_up() || sweeps_with_error_ > remembered; }

  /// A sweep was registered from `predicted`, as far as the filter knew before error() was added.
  void learn(const State& predicted, const Registration& sweep);

 private:
  static constexpr int lasting = 5, remembered = 50;  // sweeps
  static constexpr double too_often = 5;  // contradictions within `remembered` sweeps: no IMU changes so often, the description is wrong

  int sweeps_ = 0;    // that were learnt from, at most `remembered`
  double share_ = 0;  // of what met a surface: beside it
  Error usual_;       // root mean square changes by sweeps
  std::optional<Error> error_;
  double begun_ = 0;           // how often of late predictions contradicted the sweeps
  int sweeps_with_error_ = 0;  // since predictions contradicted the sweeps the last time
  double usual_change_ = 0;    // mean of squared changes by sweeps, per covariance of the prior
  int expected_sweeps_ = 0;    // in a row, that were where they usually are
  bool surprised_ = false;     // by the last sweep
};

}  // namespace kilvo
