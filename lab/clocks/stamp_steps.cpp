#include "lab/clocks/stamp_steps.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kilvo::lab {
namespace {

// Messages whose delays are compared: before a step at most, and on either side at least.
constexpr std::size_t most_delays = 50, fewest_delays = 10;
// A step is seen after so long, and is larger than this, and than messages come early or late.
constexpr Duration observed_for = std::chrono::milliseconds(300), least_step = std::chrono::milliseconds(10);
constexpr double beyond_scatter = 8;
constexpr Duration longest_wait = std::chrono::seconds(3);  // for so many messages
// Share of a step by which the delays may differ from it.
constexpr double tolerated_share = 0.3;

template <class Delays>
Duration median_of(const Delays& delays) {
  std::vector<Duration> all(delays.begin(), delays.end());
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::ranges::nth_element(all, middle);
  return *middle;
}

void keep(std::deque<Duration>& delays, Duration delay) {
  delays.push_back(delay);
  if (delays.size() > most_delays) delays.pop_front();
}

}  // namespace

void StampSteps::note_imu(Duration delay) {
  keep(of_imu_, delay);
  if (jump_) jump_->of_imu.push_back(delay);
}

void StampSteps::note(Time stamp, Time arrived) {
  if (last_ && arrived < last_->arrived) *this = StampSteps();  // another recording
  const Duration delay = arrived - stamp - correction_;
  const auto before = std::exchange(last_, Message{stamp, arrived});
  const Duration by = before ? (stamp - before->stamp) - (arrived - before->arrived) : Duration(0);
  const double size = std::abs(to_seconds(by));
  const bool jumps = size > std::max(to_seconds(least_step), beyond_scatter * scatter_);
  // What was queued arrives late and then at once, in its order. Stamps that go on are none of a clock that was set back.
  const bool may_be_set = jumps && (by > Duration(0) || stamp < before->stamp);
  // Stamps that jump to and fro are wrong ones. Without an IMU nothing is known.
  if (jump_ && (may_be_set || arrived - jump_->arrived > longest_wait)) {
    jump_.reset();
  } else if (jump_) {
    jump_->delays.push_back(delay);
    if (arrived - jump_->arrived > observed_for && std::min(jump_->delays.size(), jump_->of_imu.size()) >= fewest_delays) conclude();
    return;
  }
  if (may_be_set && std::min(delays_.size(), of_imu_.size()) >= fewest_delays) {
    jump_ = Jump{by, median_of(of_imu_), arrived, {delay}, {}};
    return;
  }
  scatter_ += (size - scatter_) / static_cast<double>(most_delays);
  keep(delays_, delay);
}

// Medians of the delays tell the step better than two messages do, each of which was on its way for its own time.
void StampSteps::conclude() {
  const Jump jump = *std::exchange(jump_, std::nullopt);
  const Duration change = median_of(jump.delays) - median_of(delays_), of_imu = median_of(jump.of_imu) - jump.imu_before;
  const Duration tolerance(static_cast<Duration::rep>(tolerated_share * static_cast<double>(std::chrono::abs(jump.by).count())));
  const bool is_step = std::chrono::abs(change + jump.by) < tolerance && std::chrono::abs(of_imu) < tolerance;
  if (is_step) correction_ += change;
  if (is_step) ++count_;
  delays_.clear();
  for (const Duration delay : jump.delays) keep(delays_, is_step ? delay - change : delay);
}

}  // namespace kilvo::lab
