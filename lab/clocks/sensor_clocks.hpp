// Sensors that stamp by a clock of another epoch than the IMU does: the time since their boot, where others have that of the day.
//
// A message arrives a little after what it says was measured, a sweep after its last point. Stamp and arrival are of two clocks, which may
// differ by anything (a recording that was played and recorded again); but they differ by the same for all sensors that share one clock,
// but for what each needs on its way. Where a sensor differs from the IMU by more than any way can take, its clock is another one, and
// its stamps are moved by one constant onto the IMU's: so that its least delay is the IMU's. What jitters in the arrival does not enter. Of
// several sensors with one such clock the one with the shortest way tells for all. Clocks that are not disciplined drift apart; that is
// followed (ClockDrift). A clock that is set while the robot walks is followed as well, by the times of arrival (StampSteps). Where it is
// the clock of arrival, nothing arrives for that time or time goes back, and the IMU's stamps go on.
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <string>

#include "kilvo/sensors/measurement.hpp"
#include "lab/clocks/clock_drift.hpp"
#include "lab/clocks/least_delay.hpp"
#include "lab/clocks/stamp_steps.hpp"

namespace kilvo::lab {

class SensorClocks {
 public:
  /// `time_offsets`: that the stamps have been given already, s, by Sensor.
  explicit SensorClocks(const std::array<double, sensor_count>& time_offsets = {});

  /// Each measurement in the order of arrival, before it is used.
  void note(const Measurement& m, Time arrived);

  /// Whether the clock of a sensor is known whose measurement has been noted. Otherwise it has to wait: most sensors are judged by one
  /// message, those with another clock by a second of them; and a jump of the stamps by what comes after it.
  bool knows(Sensor s) const { return is_given_up_ || (!streams_[index_of(s)].steps.pending() && !is_to_be_judged(s)); }
  bool knows_all() const {
    return std::ranges::all_of(all_sensors, [this](Sensor s) { return knows(s); });
  }

  /// No more is waited for: sensors that are not judged yet have the IMU's clock, and jumps are no steps.
  void give_up();
  /// Something has been waited for too long: the same of that.
  void wait_no_longer();

  /// Onto the IMU's clock, of a sensor that is known, and as the IMU's was at first.
  void correct(Measurement& m, Time arrived) const;

  /// What is added to the sensor's stamps; nothing where they are of the IMU's clock.
  const std::optional<Duration>& offset(Sensor s) const { return streams_[index_of(s)].offset; }
  /// For the user: how far the sensor's clock is from the IMU's, and the setting that does the same. Empty where it is the IMU's.
  std::string finding(Sensor s) const;
  /// The same of a clock that drifts against the IMU's. Empty where none is known to.
  std::string drift_finding(Sensor s) const;
  /// The same of a clock that was set so many times: empty where it was not.
  int steps(Sensor s) const { return streams_[index_of(s)].steps.count(); }
  std::string step_finding(Sensor s) const;

 private:
  struct Delay {
    Time arrived;
    Duration delay;  // from the stamp to the arrival, by two clocks
  };
  struct Stream {
    std::optional<Time> first;  // arrival
    std::deque<Delay> delays;   // of the last second; of the IMU, and of others until they are judged
    bool is_judged = false;
    std::optional<Duration> clock;   // from its own to the IMU's
    std::optional<Duration> offset;  // that is added: all but what has been set already
    void add(Time arrived, Duration delay);
    std::optional<Duration> least;  // delay in this stretch
    ClockDrift drift;
    double known_drift = 0;  // the newest that was not 0
    StampSteps steps;
  };
  Time unset(Time arrived) const { return arrived - set_ahead_; }
  Duration imu_delay(Time stamp, Time arrived) const { return unset(arrived) - stamp - streams_[index_of(Sensor::imu)].steps.correction(); }
  void follow_arrival(Sensor s, Time stamp, Time arrived);
  bool goes_back(Time stamp, Time arrived);
  void doubt_arrival();
  void compare_arrival(Duration went_on, Time stamp, Time arrived);
  void follow_steps(Sensor s, Time stamp, Time arrived);
  bool is_replay(Duration imu_jump, Time now) const;
  void forget_steps();
  bool is_to_be_judged(Sensor s) const { return s != Sensor::imu && !streams_[index_of(s)].is_judged && streams_[index_of(s)].first; }
  void judge(Sensor s, Time arrived);
  void follow_drift(Stream& stream, Time arrived, Duration delay);

  std::array<double, sensor_count> time_offsets_;
  std::array<Stream, sensor_count> streams_;
  bool is_given_up_ = false;
  std::optional<Time> stretch_;  // when it began
  struct Message {
    Time stamp, arrived;
  };
  std::optional<Message> imu_;             // the newest one
  LeastDelay imu_delays_;                  // of late, by the clock of arrival as it was at first
  std::optional<Time> newest_;             // arrival of any message
  bool is_out_of_order_ = false;           // the newest message of the IMU
  bool is_arrival_unclear_ = false;        // the clock of arrival may have been set
  std::optional<LeastDelay> heard_again_;  // of the IMU's messages since then
  Duration set_ahead_{};                   // by which the clock of arrival has been
};

}  // namespace kilvo::lab
