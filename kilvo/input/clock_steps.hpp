// Clocks that step back: the computer's time was set, or a recording is played in a loop; and an IMU whose clock steps either way by
// itself, which the legs tell. What comes after the step is put after what came before, as it was measured.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/reason.hpp"

namespace kilvo {

class ClockSteps {
 public:
  /// Takes the measurements in the order of their arrival and puts each onto the time axis of the first. Says why one is not to be used:
  /// the IMU's time has stepped, and whether it stays so is not known yet. Such a one is left as it is. `time_jump`: the IMU's stamp lies
  /// ahead of where the next one was due, and whether samples are missing or it is wrong is for the next to tell.
  std::optional<Reason> follow(Measurement& m);
  /// The newest sample of the IMU goes on from the one before, of which follow() reported a `time_jump`: that one is right.
  bool went_on() const { return went_on_; }

  /// How often all time went back by more than an estimator looks back: a recording is played again, or another one. What comes then has
  /// its own stamps.
  std::uint64_t restarts() const { return restarts_; }

  /// How often the IMU's time stepped for good, and by how much it went back at the last time (ahead: negative).
  std::uint64_t count() const { return count_; }
  Duration last() const { return last_; }

 private:
  std::optional<Reason> follow_imu(Time t);
  bool is_sure() const;
  bool has_run_ahead(Time now) const;
  bool must_wait(Time now);
  void note_hole(Time until) { holes_[next_hole_++ % holes_.size()] = {*imu_, until}; }
  bool is_late(Time now) const;
  void restart(Time imu);
  void vote(std::size_t s, Time t);

  std::array<Duration, sensor_count> offset_{};  // added to the stamps, by Sensor
  // By which the stamps of each trail the IMU's as they arrive.
  std::array<std::optional<Duration>, sensor_count> lag_;
  // Whether each goes with the IMU is found out from its first messages after a step.
  std::array<bool, sensor_count> open_{};
  std::array<std::optional<Time>, sensor_count> open_until_;
  std::array<std::optional<Time>, sensor_count> newest_;  // of each, with its offset
  std::optional<Time> imu_;                               // the newest, with its offset
  std::array<std::pair<Time, Time>, 4> holes_{};          // between stamps of the IMU, the last ones
  std::size_t next_hole_ = 0;
  std::optional<Time> suspect_;  // a stamp of the IMU ahead of what was due
  bool went_on_ = false;
  Duration period_ = std::chrono::seconds(1);  // of the IMU, lately
  std::optional<Time> legs_;                   // the newest, with its offset
  std::optional<Time> legs_then_;              // when the IMU spoke last
  std::optional<Duration> legs_behind_;        // by which they trail the IMU when it speaks
  Duration legs_spacing_ = std::chrono::seconds(1);
  int elsewhere_ = 0;                    // IMU samples in a row of another time
  Time first_there_{}, newest_there_{};  // of them
  int for_ = 0, against_ = 0;            // messages of the others meanwhile that went with them, and that did not
  std::uint64_t count_ = 0, restarts_ = 0;
  Duration last_{};
};

}  // namespace kilvo
