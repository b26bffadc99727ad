// Stamps of a sensor that measures without a pause, as even as its measuring is.
//
// A LiDAR and an IMU are paced by oscillators of their own. Where the computer stamps a message when it notices it, the stamps scatter by
// milliseconds, or come in bursts, and contradict each other: a sweep begins before the one before has ended, an IMU has measured twice
// within half a period. No sensor does that. Then a straight line through the stamps of the last messages tells better when each was
// measured than its own stamp. Stamps that show no such contradiction are kept: what scatters there may be the sensor.
#pragma once

#include <cstdint>
#include <optional>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class EvenStamps {
 public:
  /// Of each sweep in the order of arrival: its stamp, and when its first and its last point were measured by it. Returns the stamp to
  /// use: the mean of the line.
  Time follow_sweep(Time stamp, Time first, Time last);

  /// Of each sample of an IMU. Returns the stamp to use: the line of those that waited least, were their delays anything up to the longest.
  Time follow_sample(Time stamp);

  /// s, standard deviation of the stamps from even ones, where those are used.
  std::optional<double> scatter() const;

 private:
  /// The stamp by the line; nothing where the stamp is to be used as it is. `contradiction` with the one before: 1, -1 the contrary, 0
  /// neither. `limit`: s, farther from the line none can be.
  std::optional<Time> follow(Time stamp, double contradiction, double limit);
  void restart(Time stamp);
  void count_what_is_missing();
  bool is_even() const;

  Time expected_{};  // of the message that was followed last, by the line
  double period_ = 0;
  std::uint64_t count_ = 0;  // messages of this line
  int strangers_ = 0;        // in a row that do not fit
  Time last_stamp_{}, last_end_{};
  // Over the last messages: mean squares of the stamps from the line and of the steps between them, their mean distance from the line, and
  // how many contradict the one before.
  double deviation2_ = 0, step2_ = 0, late_ = 0, contradictions_ = 0;
};

}  // namespace kilvo::lab
