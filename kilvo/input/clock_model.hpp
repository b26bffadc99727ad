// What the stamps of one sensor show of its clock.
#pragma once

#include <algorithm>
#include <optional>

#include "kilvo/sensors/time.hpp"

namespace kilvo {

struct ClockModel {
  std::optional<Time> newest;
  Duration spacing{};           // between messages, the least of lately; 0: not known
  std::optional<Duration> lag;  // of its stamps behind the IMU's newest when they arrive, the most of lately

  void note(Time t) {
    // Grows slowly, whatever was missed: a message more that is waited for costs little, one that is not may come too late.
    if (newest && t > *newest) {
      const Duration gap = t - *newest;
      spacing = spacing == Duration(0) || gap < spacing ? gap : spacing + (std::min(gap, 2 * spacing) - spacing) / 8;
    }
    newest = t;
  }

  /// One message that is late by more than `most` counts as late by that.
  void note_lag(Duration behind, Duration most) {
    behind = std::min(behind, most);
    // Forgets by 2 ms in a second, or in some seconds: an IMU that comes late for a moment makes the others trail it by less.
    lag = lag ? std::max(behind, *lag - std::max(spacing / 512, *lag / 4096)) : behind;
  }

  /// More time than between two messages, whatever their jitter: some are missing, or the stamp is wrong.
  bool is_gap(Duration since_newest) const { return spacing > Duration(0) && since_newest > std::max(stamp_jitter, 5 * spacing / 2); }

  // A stamp that goes back or ahead by less belongs to a message that has come late or early.
  static constexpr Duration stamp_jitter = std::chrono::milliseconds(15);
};

}  // namespace kilvo
