// What waits for the slow thread. When it falls behind, the oldest scans and images give way, for the IMU and the legs carry the state.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo::live {

using Clock = std::chrono::steady_clock;

struct Arrival {
  Measurement m;
  Clock::time_point at;
};

class Backlog {
 public:
  void push(Arrival arrival);
  /// Waits, then takes all there is, in order. False: closed, and nothing is left.
  bool take(std::vector<Arrival>& out);
  /// Nothing more comes in.
  void close();

  /// By Sensor: what gave way.
  std::array<std::uint64_t, sensor_count> dropped() const;
  std::uint64_t given_up() const;  // all of it
  std::size_t deepest() const;

 private:
  void make_room(Sensor s);

  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::vector<Arrival> waiting_;
  std::array<std::size_t, sensor_count> count_{};  // of those that wait, by Sensor
  std::array<std::uint64_t, sensor_count> dropped_{};
  std::size_t deepest_ = 0;
  bool closed_ = false;
};

}  // namespace kilvo::live
