// The clearances of one foot over the last second (paper, Eq. 18), with their area and trend (Section V-B).
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class ClearanceWindow {
 public:
  /// Keeps one clearance per millisecond at most, for about a second. c: m over the ground patch.
  void add(Time t, double c);
  void clear() { count_ = 0; }

  /// Signed area between the clearances of the last `slice` and their chord, m s: positive for a foot that rose and came down again, zero
  /// for one that stood or moved evenly. Nothing from fewer than three clearances.
  std::optional<double> area(Duration slice) const;

  /// Trend of the clearances of the last `slice` by linear regression (k_c), m/s. Nothing from fewer than three clearances.
  std::optional<double> trend(Duration slice) const;

 private:
  struct Entry {
    Time t{};
    double c = 0;
  };
  static constexpr std::size_t capacity = 1024;

  /// `back` entries before the newest.
  const Entry& before(std::size_t back) const { return entries_[(count_ - 1 - back) % capacity]; }
  /// How many of the newest entries lie within `slice` of the newest.
  std::size_t within(Duration slice) const;

  std::array<Entry, capacity> entries_{};
  std::size_t count_ = 0;  // of all that came; the last `capacity` are kept
};

}  // namespace kilvo::lab
