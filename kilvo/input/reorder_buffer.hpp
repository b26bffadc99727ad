// Measurements that wait for earlier ones, bounded in memory.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// When a measurement is complete: a scan at its last point, anything else at its stamp.
Time completion_of(const Measurement& m);

class ReorderBuffer {
 public:
  void push(Time completion, Measurement m);
  /// The first by completion; of the same time the IMU first, then by arrival. There must be one.
  Measurement pop();
  Time first() const { return heap_.front().completion; }

  bool empty() const { return heap_.empty(); }
  std::size_t size() const { return heap_.size(); }

  /// Gives up the oldest of a sensor while those that wait fill too much memory or span too much time, up to its newest. Returns how many.
  int bound(Sensor s, Time newest);

 private:
  struct Entry {
    Time completion;
    std::uint64_t arrival;
    Measurement measurement;
  };
  static bool is_later(const Entry& a, const Entry& b);

  std::vector<Entry> heap_;                        // nothing is allocated at the rate of the legs
  std::array<std::size_t, sensor_count> bytes_{};  // of what waits, by Sensor
  std::uint64_t arrivals_ = 0;
};

}  // namespace kilvo
