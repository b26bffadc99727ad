#include "apps/cli/pace.hpp"

#include <algorithm>
#include <thread>

namespace kilvo::cli {

bool Pace::wait_for(Time arrived, InterruptWatch& interrupt) {
  constexpr auto nap = std::chrono::milliseconds(50);  // a user who wants to stop waits no longer
  if (!first_) {
    first_ = arrived;
    begin_ = Clock::now();
  }
  const auto due =
      begin_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(to_seconds(arrived - *first_) / speed_));
  while (!interrupt.requested()) {
    const auto now = Clock::now();
    if (now >= due) return true;
    std::this_thread::sleep_until(std::min(due, now + nap));
  }
  return false;
}

}  // namespace kilvo::cli
