// Puts measurements into the order of their stamps. A measurement is released when every expected sensor has been heard beyond it, or
// when it has waited max_wait of the IMU's time.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// When a measurement is complete: a scan at its last point, anything else at its stamp.
Time completion_of(const Measurement& m);

/// When the first point of a scan was taken.
Time begin_of(const LidarScan& scan);

class Timeline {
 public:
  Timeline(std::array<bool, sensor_count> expected, Duration max_wait) : expected_(expected), max_wait_(max_wait) {}

  /// Takes the measurement, or says why not ("late", "duplicate"). One that is over a second ahead of all others is kept apart: if the
  /// next ones are there as well, time has really passed; if not, its clock was wrong (take_jumped).
  std::optional<std::string> push(Measurement m);

  /// Sensors of the measurements that turned out to be ahead by mistake, since the last call.
  std::vector<Sensor> take_jumped() { return std::exchange(jumped_, {}); }

  /// The next measurement in order, if it need not wait.
  std::optional<Measurement> pop();

  /// From now on nothing waits: the recording has ended.
  void end();

 private:
  bool may_go(Time key) const;
  void give_up_suspects();
  std::optional<std::string> admit(Measurement m, Time key);

  std::array<bool, sensor_count> expected_;
  std::array<std::optional<Time>, sensor_count> newest_;
  std::array<std::optional<Time>, sensor_count> stamp_;  // of the newest
  std::optional<Time> released_, newest_of_all_;
  // By completion; of the same time the IMU first; then by arrival.
  using Queue = std::map<std::tuple<Time, Sensor, std::uint64_t>, Measurement>;
  Queue waiting_;
  std::vector<Queue::node_type> spare_;  // nodes of what has gone, to be used again: nothing is allocated at the rate of the legs
  std::vector<Measurement> suspects_;    // ahead of all others
  std::vector<Sensor> jumped_;
  std::uint64_t sequence_ = 0;
  Duration max_wait_;
  bool ended_ = false;
};

}  // namespace kilvo
