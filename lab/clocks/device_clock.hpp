// When the samples of a device were taken, by the clock of the computer that receives them. The device counts evenly but by a clock of its
// own, or not at all; the computer sees when each sample arrives, which is late by more or less. The mean of many is neither.
#pragma once

#include <cstdint>
#include <optional>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class DeviceClock {
 public:
  /// `period`: s, nominal, between samples.
  explicit DeviceClock(double period) : period_(period) {}

  /// Of each sample, in the order of arrival: its time by the device's clock, if it has one, and when it arrived. Samples of one time by
  /// both clocks are of one message. A device whose clock stands still, or jumps, is taken for one without.
  Time follow(std::optional<Duration> device, Time arrived);

 private:
  double period_;
  std::optional<Duration> device_;  // of the sample before
  Time arrived_{}, time_{};         // the same
  std::uint64_t count_ = 0;         // since the last beginning
};

/// A counter of milliseconds of 32 bits, made one that does not wrap around.
class TickCounter {
 public:
  Duration unwrapped(std::uint32_t tick);

 private:
  std::optional<std::uint32_t> last_;
  std::int64_t milliseconds_ = 0;
};

}  // namespace kilvo::lab
