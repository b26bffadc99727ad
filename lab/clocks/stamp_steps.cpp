#include "lab/clocks/stamp_steps.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kilvo::lab {
namespace {

// Messages whose delays are compared: before a step at most and at least, and after it at least.
constexpr std::size_t most_delays = 50, fewest_delays = 10, fewest_after = 3;
// A step is larger than this, and than messages come early or late.
constexpr Duration least_step = std::chrono::milliseconds(10);
constexpr double beyond_scatter = 8;
constexpr Duration longest_wait = std::chrono::seconds(3);  // for so many messages
// A clock that goes back by more may be a recording that is played again: all the others have to show it.
constexpr Duration far_back = std::chrono::seconds(2);
constexpr int patience = 6;  // as long then
// What was observed longer ago tells nothing: clocks drift.
constexpr Duration memory = std::chrono::minutes(1);
// A jump ahead is a step where messages come sooner than they ever did for so long, or by more than any driver keeps them.
constexpr Duration long_enough = std::chrono::seconds(2), longest_queue = std::chrono::seconds(10);
// Share of a step by which the delays may differ from it.
constexpr double tolerated_share = 0.3;

template <class Delays>
Duration median_of(const Delays& delays) {
  std::vector<Duration> all(delays.begin(), delays.end());
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::ranges::nth_element(all, middle);
  return *middle;
}

}  // namespace

StampSteps::StampSteps(Duration observed_for) : observed_for_(observed_for), least_(memory) {}

void StampSteps::postpone() {
  if (jump_) last_ = std::exchange(jump_, std::nullopt)->before;
}

void StampSteps::interrupt() {
  jump_.reset();
  delays_.clear();
  last_.reset();
}

void StampSteps::note(Time stamp, Time arrived) {
  if (last_ && arrived - last_->arrived > memory) interrupt();
  const Duration delay = arrived - stamp - correction_;
  const auto before = std::exchange(last_, Message{stamp, arrived});
  const Duration by = before ? (stamp - before->stamp) - (arrived - before->arrived) : Duration(0);
  const double size = std::abs(to_seconds(by)), least = std::max(to_seconds(least_step), beyond_scatter * scatter_);
  // What was queued arrives late and then at once, in its order. Stamps that go on are none of a clock that was set back.
  const bool jumps = size > least && (by > Duration(0) || stamp < before->stamp);
  // Stamps that jump to and fro are wrong ones.
  if (jump_ && (jumps || arrived - jump_->arrived > longest_wait)) {
    jump_.reset();
  } else if (jump_) {
    jump_->delays.push_back(delay);
    const Duration enough = (jump_->by < -far_back ? patience : 1) * observed_for_;
    if (arrived - jump_->arrived > enough && jump_->delays.size() >= fewest_after) conclude();
    return;
  }
  if (jumps && delays_.size() >= fewest_delays && std::abs(to_seconds(delay - median_of(delays_))) > least) {
    jump_ = Jump{by, arrived, *before, {delay}};
    return;
  }
  scatter_ += (std::min(size, least) - scatter_) / static_cast<double>(most_delays);
  least_.add(arrived, delay);
  delays_.push_back(delay);
  if (delays_.size() > most_delays) delays_.pop_front();
}

// Medians of the delays tell the step better than two messages do, each of which was on its way for its own time. A sensor that is late for
// long and drops what had waited jumps ahead as well, but does not come sooner than ever.
void StampSteps::conclude() {
  const Jump jump = *std::exchange(jump_, std::nullopt);
  const Duration now = median_of(jump.delays), change = now - median_of(delays_);
  const Duration tolerance(static_cast<Duration::rep>(tolerated_share * static_cast<double>(std::chrono::abs(jump.by).count())));
  const bool is_sooner = now < least_.value() - least_step / 2 && (least_.observed() > long_enough || -change > longest_queue);
  const bool may_be = jump.by < Duration(0) || is_sooner;
  const bool is_step = may_be && std::chrono::abs(change + jump.by) < tolerance;
  if (is_step) {
    correction_before_ = std::exchange(correction_, correction_ + change);
    since_ = jump.arrived;
    ++count_;
  }
  delays_.clear();
  for (const Duration delay : jump.delays) delays_.push_back(is_step ? delay - change : delay);
  while (delays_.size() > most_delays) delays_.pop_front();
}

}  // namespace kilvo::lab
