// Clocks that step. Every stamp of the IMU that is not where the next one was due is one of four things: late (a gap is filled), wrong,
// the first after a gap, or of a clock that has stepped, alone or with the others. The stamps that follow it decide, and how long after
// the IMU the messages of the others come. What comes after a step is put after what came before, as it was measured.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "kilvo/input/clock_model.hpp"
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

  /// How often all time went back by more than an estimator looks back: another recording is played, and has its own stamps.
  std::uint64_t restarts() const { return restarts_; }

  /// How often the IMU's time stepped for good, and by how much it went back at the last time (ahead: negative).
  std::uint64_t count() const { return count_; }
  Duration last() const { return last_; }

 private:
  struct Clock : ClockModel {
    Duration offset{};                  // added to its stamps
    std::optional<Duration> usual_lag;  // of its stamps behind the IMU's newest, the mean
    Time may_step_until = Time::min();  // until then its messages show whether it went with the IMU's step
  };
  // Stamps of the IMU in a row that are not where the next one was due, but follow each other.
  struct Run {
    int length = 0;
    Time first{}, newest{};
    int with = 0, without = 0;  // messages of the others meanwhile that went with them, and that did not
    void add(Time t);
  };
  std::optional<Reason> follow_imu(Time t);
  void follow_other(Clock& clock, Time t);
  bool is_sure() const;
  bool has_run_ahead(Time now) const;
  bool is_late(Time now) const;
  void note_hole(Time until) { holes_[next_hole_++ % holes_.size()] = {*imu().newest, until}; }
  void restart(Time imu);
  void vote(const Clock& clock, Time t);
  Clock& imu() { return clocks_[index_of(Sensor::imu)]; }
  const Clock& imu() const { return clocks_[index_of(Sensor::imu)]; }
  const Clock& legs() const { return clocks_[index_of(Sensor::legs)]; }

  std::array<Clock, sensor_count> clocks_;        // newest: with the offset
  std::array<std::pair<Time, Time>, 4> holes_{};  // between stamps of the IMU, the last ones
  std::size_t next_hole_ = 0;
  std::optional<Time> suspect_;  // the newest stamp of the IMU, when it was ahead of what was due
  bool went_on_ = false;
  std::optional<Time> legs_then_;  // of the legs, the newest when the IMU spoke last
  Run run_;
  std::uint64_t count_ = 0, restarts_ = 0;
  Duration last_{};
};

}  // namespace kilvo
