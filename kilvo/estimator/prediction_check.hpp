// Whether sweeps find the robot where the IMU predicted it. The filter's covariance knows the IMU's noise, not a bias that steps, a scale
// that is wrong or a clock that jumps: then it outvotes the sweeps, whose points are rejected one by one. Of what meets a surface the share
// that lies beside it hardly changes from sweep to sweep, whatever the place; where it rises, and another pose near by brings it back, the
// prediction was wrong. In a crowd no pose does.
#pragma once

#include <bit>

#include "kilvo/lidar/lidar_pipeline.hpp"

namespace kilvo {

class PredictionCheck {
 public:
  static constexpr int remembered = 50;  // sweeps

  /// It was registered much farther from `prior` than the covariance says and than sweeps usually are: the first one of its kind after some
  /// that were not, as after a push, or one more, which is none. `map_error`: of the map around the prior. To be asked once a sweep;
  /// one that `rejoins` the map may be anywhere.
  enum class Surprise : std::uint8_t { none, first, again };
  Surprise surprise(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error, bool rejoins);
  /// It fits nowhere, or of what meets a surface a tenth more than usual lies beside it.
  bool contradicts(const Registration& sweep) const;
  /// No pose near by explains it, and one farther away may: the sweeps before may have been smeared. In a crowd there is none, and the more
  /// sweeps were not explained, the less often a search is worth its time.
  bool is_to_be_searched_for() const { return std::has_single_bit(contradicted_sweeps_ + 1); }
  /// The prior from which the sweep is to be registered again: uncertain as far as the nearest planes are the right ones.
  static Estimate released(const Estimate& prior);
  /// Uncertain beyond that: the sweep is searched for. After some that nothing explained the robot may have been moved to anywhere near.
  Estimate lost(const Estimate& prior) const;
  /// So many sweeps in a row were not explained.
  bool lies_beside_for_long() const { return contradicted_sweeps_ == 2 * enough; }
  /// `again`, the same sweep from another prior, lies on the surfaces as sweeps usually do.
  bool explains(const Registration& again, const Registration& sweep) const;

  /// How far a prediction may be off, beyond its covariance: standard deviations of each axis, rad and m.
  struct Error {
    double turned = 0, moved = 0;
  };
  static Error error_between(const State& predicted, const State& found);
  /// That of a prediction that may be right.
  static bool is_small(const Error& off);
  /// Farther than a prediction is ever off: the robot was moved.
  static bool is_far(const Error& off);
  /// The prediction at `t` was off by this: those that follow may be as well.
  void begin(Time t, const Error& off);
  /// Of the predictions now, as the last sweeps show it; none while they are right.
  const std::optional<Error>& error() const { return error_; }
  /// That has lasted for some sweeps: a shock has passed by then, a bias has not. True for one of them.
  bool lasts() const { return error_ && sweeps_with_error_ == enough; }
  /// It had ended, a moment ago: no shock either.
  bool recurs() const { return !error_ && begun_ > 0.5; }

  /// Too often contradicted to be the IMU's: nothing is doubted any more.
  bool gives_up() const { return begun_ >= too_often; }
  /// That, or for seconds every other sweep was not where it was predicted.
  bool is_hopeless() const { return gives_up() || (error_ && unusual_share_ > 0.5 && lasted_ > std::chrono::seconds(5)); }

  /// A sweep was registered; `prior`: as far as the filter knew before error() was added.
  void learn(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error);

 private:
  static constexpr int enough = 5;        // sweeps
  static constexpr double too_often = 5;  // contradictions of late, about one in ten sweeps: no IMU changes so often

  bool lies_beside(const RegistrationReport& report) const;
  bool is_unusual(double change) const;

  int sweeps_ = 0;                    // that were learnt from, at most `remembered`
  double share_ = 0;                  // of what met a surface: beside it
  unsigned contradicted_sweeps_ = 0;  // in a row, whatever was tried
  std::optional<Error> error_;
  double begun_ = 0;           // how often of late predictions contradicted the sweeps
  Time since_{};               // there is an error
  Duration lasted_{};          // until the last sweep that measured anything
  bool recurred_ = false;      // soon after it had ended
  int sweeps_with_error_ = 0;  // since predictions contradicted the sweeps the last time
  int doubted_sweeps_ = 0;     // since there is an error, at most `remembered`
  double unusual_share_ = 0;   // of those: not where they usually are
  int agreeing_sweeps_ = 0;    // in a row, that were
  double usual_change_ = 0;    // mean of squared changes by sweeps, per covariance of the prior
  int in_a_row_ = 0;           // sweeps without error() that were where they usually are; negative: that were not
  bool surprised_ = false;     // by the last sweep, the first one
};

}  // namespace kilvo
