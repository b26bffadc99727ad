// Stamps of a sensor that measures without a pause, as even as its measuring is.
//
// A LiDAR and an IMU are paced by oscillators of their own. Where the computer stamps a message when it notices it, the stamps scatter by
// milliseconds, or come in bursts, and contradict each other: a sweep begins before the one before has ended, an IMU has measured five
// times at once. No sensor does that. Stamps that show no such contradiction are kept to the last bit: what scatters there may be the
// sensor.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

/// Sweeps whose stamps scatter: a straight line through the last minute of stamps tells better when each was measured than its own.
class EvenSweeps {
 public:
  /// Of each sweep in the order of arrival: its stamp, and when its first and its last point were measured by it. Returns the stamp to use.
  Time follow(Time stamp, Time first, Time last);

  /// s, standard deviation of the stamps from the line, where that is used.
  std::optional<double> scatter() const;

 private:
  void restart(Time stamp);
  double contradiction_of(Time stamp, Time first, Time last);
  std::optional<Time> off_line(Time stamp, Time predicted, double surprise);
  void learn(Time stamp, Time predicted, double steps, double contradiction);
  void decide();

  Time expected_{};  // of the sweep that was followed last, by the line
  double period_ = 0;
  std::uint64_t count_ = 0;  // sweeps of this line
  int strangers_ = 0;        // in a row that do not fit
  bool is_used_ = false;
  Time last_stamp_{}, last_end_{};
  // Over the last sweeps: mean squares of the stamps from the line and of the steps between them, mean product of every other step, time
  // between two sweeps, and how many begin too early.
  double deviation2_ = 0, step2_ = 0, alternating_ = 0, gap_ = 0, contradictions_ = 0;
  double step_ = 0, step_before_ = 0;  // s, beyond the period
};

/// Samples of an IMU that are handed over several at a time: the newest of a burst has waited least, those before it are a period apart.
class EvenSamples {
 public:
  /// Of each sample in the order of arrival, its stamp. Returns the stamp to use, which is never later.
  Time follow(Time stamp);

  /// s, by how much the stamps are late in the mean, where others are used.
  std::optional<double> lateness() const { return is_used_ ? std::optional(late_) : std::nullopt; }

 private:
  void restart(Time stamp);
  void look_at_step(double step);

  std::deque<Time> stamps_;  // the newest
  std::optional<Time> last_, given_;
  double period_ = 0, at_once_ = 0, late_ = 0;  // s; share of samples that come at once; s
  bool is_used_ = false;
};

}  // namespace kilvo::lab
