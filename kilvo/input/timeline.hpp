// Puts measurements into the order of their stamps. A measurement is released when nothing of an earlier stamp can be expected any more
// that must go before it, or when it has waited max_wait of the IMU's time.
//
// Scans are waited for from when the next one may be complete. So are images; but since a late one is fused all the same, one need not.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/reason.hpp"

namespace kilvo {

/// When a measurement is complete: a scan at its last point, anything else at its stamp.
Time completion_of(const Measurement& m);

/// When the first and when the last point of a scan were taken.
Time begin_of(const LidarScan& scan);
Time end_of(const LidarScan& scan);

/// Stamps farther apart than this are of a clock that has jumped; so many in a row that agree with each other show that time really has.
inline constexpr Duration clock_jump = std::chrono::seconds(1);
inline constexpr int clock_witnesses = 10;

class Timeline {
 public:
  Timeline(std::array<bool, sensor_count> expected, Duration max_wait, bool wait_for_images = true)
      : expected_(expected), max_wait_(max_wait), wait_for_images_(wait_for_images) {}

  /// Takes the measurement, or says why not (late, duplicate). Scans and images may come up to max_wait after others of their time have
  /// been released: they go next. One that is over a second ahead of all others is kept apart: if the
  /// next ones are there as well, time has really passed; if not, its clock was wrong (take_jumped).
  std::optional<Reason> push(Measurement m);

  /// Sensors of the measurements that turned out to be ahead by mistake, since the last call.
  std::vector<Sensor> take_jumped() { return std::exchange(jumped_, {}); }

  /// Sensors of the measurements that were given up since the last call, the oldest of each first: more of it waited than there is room
  /// for, because the IMU is silent.
  std::vector<Sensor> take_given_up() { return std::exchange(given_up_, {}); }

  /// The next measurement in order, if it need not wait.
  std::optional<Measurement> pop();

  /// From now on nothing waits: the recording has ended.
  void end();

 private:
  bool may_go(Time key) const;
  bool is_awaited(Sensor sensor, Time key) const;
  void note_spacing(std::size_t s, Time key);
  void give_up_suspects();
  void bound(Sensor sensor);
  void note_legs(Time key);
  std::optional<Reason> admit(Measurement m, Time key);

  std::array<bool, sensor_count> expected_;
  std::array<std::optional<Time>, sensor_count> newest_;
  std::array<std::optional<Time>, sensor_count> stamp_;  // of the newest
  std::array<Duration, sensor_count> spacing_{};         // of the keys, lately, at the least
  std::optional<Time> released_, newest_of_all_;
  // By completion; of the same time the IMU first; then by arrival.
  using Queue = std::map<std::tuple<Time, Sensor, std::uint64_t>, Measurement>;
  Queue waiting_;
  std::vector<Queue::node_type> spare_;  // nodes of what has gone, to be used again: nothing is allocated at the rate of the legs
  std::vector<Measurement> suspects_;    // ahead of all others
  std::vector<Sensor> jumped_, given_up_;
  std::array<std::size_t, sensor_count> bytes_{};  // of what waits, by Sensor
  std::uint64_t sequence_ = 0;
  Duration max_wait_;
  std::optional<Time> first_imu_;
  Duration legs_lag_{};  // by which the legs' stamps trail the IMU's as they arrive, the most of lately
  bool wait_for_images_;
  bool ended_ = false;
};

}  // namespace kilvo
