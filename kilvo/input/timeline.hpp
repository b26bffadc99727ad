// Puts measurements into the order of their stamps. One is released when nothing earlier can be expected any more, or when it has waited
// max_wait of the IMU's time. Scans and images are waited for from when the next one may be complete; images need not be.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "kilvo/input/clock_model.hpp"
#include "kilvo/input/reorder_buffer.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/reason.hpp"

namespace kilvo {

/// Stamps farther apart have nothing to do with each other: a clock has jumped, or nobody is there. So many in a row that agree show it.
inline constexpr Duration clock_jump = std::chrono::seconds(1);
inline constexpr int clock_witnesses = 10;

/// A message that is not let through.
struct Refusal {
  Sensor sensor;
  Reason reason;
};

class Timeline {
 public:
  Timeline(std::array<bool, sensor_count> expected, Duration max_wait, bool wait_for_images = true)
      : expected_(expected), max_wait_(max_wait), wait_for_images_(wait_for_images) {}

  /// Takes the measurement, or refuses it (late, duplicate). Scans and images may come up to max_wait after others of their time have been
  /// released: they go next. One that is over a second ahead of all others is kept apart: if the next ones are there as well, time has
  /// really passed; if not, its clock was wrong (time_jump).
  void push(Measurement m);

  /// What was refused since the last call; no_imu: the IMU is silent, and more of this sensor waited than there is room for.
  std::vector<Refusal> take_refused() { return std::exchange(refused_, {}); }

  /// The next measurement in order, if it need not wait.
  std::optional<Measurement> pop();

  /// From now on nothing waits: the recording has ended.
  void end();

 private:
  bool may_go(Time key) const;
  bool is_awaited(Sensor sensor, Time key) const;
  void give_up_suspects();
  std::optional<Reason> admit(Measurement m, Time key);
  const std::optional<Time>& newest(Sensor s) const { return clocks_[index_of(s)].newest; }

  std::array<bool, sensor_count> expected_;
  Duration max_wait_;
  bool wait_for_images_;
  std::array<ClockModel, sensor_count> clocks_;  // of completions
  std::optional<Time> first_imu_, released_, newest_of_all_;
  ReorderBuffer waiting_;
  std::vector<Measurement> suspects_;  // ahead of all others
  std::vector<Refusal> refused_;
  bool ended_ = false;
};

}  // namespace kilvo
