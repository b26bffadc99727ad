// The least of the delays of late: what waited in a queue does not enter it, and a clock that drifts does not leave it behind for good.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class LeastDelay {
 public:
  /// Of the last `span` at least, of twice as long at most.
  explicit LeastDelay(Duration span) : span_(span) {}

  void add(Time arrived, Duration delay) {
    if (!first_) first_ = begin_ = arrived;
    if (arrived - begin_ > span_) {
      before_ = std::exchange(now_, std::nullopt);
      begin_ = arrived;
    }
    now_ = std::min(now_.value_or(delay), delay);
    newest_ = arrived;
  }

  /// Once one has been added.
  Duration value() const { return std::min(*now_, before_.value_or(*now_)); }
  /// Since the first.
  Duration observed() const { return first_ ? newest_ - *first_ : Duration(0); }

 private:
  Duration span_;
  std::optional<Time> first_;
  Time begin_, newest_;
  std::optional<Duration> before_, now_;
};

}  // namespace kilvo::lab
