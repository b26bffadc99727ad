#include "lab/clocks/device_clock.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo::lab {
namespace {

// Over which times of arrival are averaged, s: an even counter carries the time from sample to sample, the nominal period less well.
constexpr double counted_memory = 5, uncounted_memory = 0.5;
// More is no jitter but another beginning, s.
constexpr double longest_surprise = 0.2;

}  // namespace

Time DeviceClock::follow(std::optional<Duration> device, Time arrived) {
  if (count_ > 0 && arrived == arrived_ && device == device_) return time_;  // another part of the same message
  const double passed = to_seconds(arrived - arrived_);
  double step = period_;
  bool counted = false;
  if (device && device_) {
    const double advance = to_seconds(*device - *device_);
    // Messages may overtake each other.
    counted = advance != 0 && std::abs(advance - passed) < longest_surprise;
    if (counted) step = advance;
  }
  const Time predicted = time_ + from_seconds(step);
  const double surprise = to_seconds(arrived - predicted);
  if (count_ == 0 || std::abs(surprise) > longest_surprise) {
    time_ = arrived;
    count_ = 1;
  } else {
    ++count_;
    const double share =
        std::max(1.0 / static_cast<double>(count_), std::min(1.0, period_ / (counted ? counted_memory : uncounted_memory)));
    time_ = predicted + from_seconds(share * surprise);
  }
  device_ = device;
  arrived_ = arrived;
  return time_;
}

Duration TickCounter::unwrapped(std::uint32_t tick) {
  if (last_) milliseconds_ += static_cast<std::int32_t>(tick - *last_);
  last_ = tick;
  return std::chrono::milliseconds(milliseconds_);
}

}  // namespace kilvo::lab
