// Lets a recording pass as fast as it was made, or so many times faster.
#pragma once

#include <chrono>
#include <optional>

#include "apps/cli/interrupt.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo::cli {

class Pace {
 public:
  explicit Pace(double speed) : speed_(speed) {}

  /// Waits until it is time for what arrived then. The first call sets the clock. False: the user wants to stop.
  bool wait_for(Time arrived, InterruptWatch& interrupt);

 private:
  using Clock = std::chrono::steady_clock;
  double speed_;
  std::optional<Time> first_;
  Clock::time_point begin_;
};

}  // namespace kilvo::cli
