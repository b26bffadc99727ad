#include "lab/messages/even_stamps.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo::lab {
namespace {

// Sweeps that the line is laid through (an oscillator keeps its period for a minute), and that statistics are of.
constexpr double memory = 600, recent = 150;
constexpr std::uint64_t fewest = 20;
// What is more even than this needs no help, s; nor do sweeps overlap that begin earlier by less (beams are fired in groups).
constexpr double even_enough = 1e-4, least_overlap = 5e-5;
// So many sweeps contradict the one before where stamps scatter (by chance alone a third), and no more where they do not any longer.
constexpr double contradicting = 0.1, contented = 0.03;
// Steps between stamps that scatter about a line have twice their variance; those of a sensor that itself scatters have less than the line.
constexpr double share_of_steps = 0.75;
// Of the variance: what every other step has in common where two sensors take turns.
constexpr double taking_turns = 0.4;
// Standard deviations beyond which a stamp does not fit, and how many in a row begin another line.
constexpr double sigmas = 6;
constexpr int too_many = 3;

// A burst: samples that come within so much of a period of the one before; so many of all do where an IMU comes in bursts, and at least.
constexpr double at_once = 0.1, bursting = 0.3, no_more_bursting = 0.15;
constexpr std::size_t fewest_samples = 30, most_samples = 500;
// s; no batch of samples waits for longer.
constexpr double longest_batch = 0.1;
// Of what the newest sample of a burst seems to be late.
constexpr double gain = 0.1;

double square(double x) { return x * x; }

}  // namespace

void EvenSweeps::restart(Time stamp) {
  const Time end = last_end_;
  *this = EvenSweeps();
  expected_ = last_stamp_ = stamp;
  last_end_ = end;
  count_ = 1;
}

std::optional<double> EvenSweeps::scatter() const { return is_used_ ? std::optional(std::sqrt(deviation2_)) : std::nullopt; }

// A sweep begins before the one before has ended, and by more than usual. One that goes back is of a message that was overtaken: messages
// that do not come in the order in which they were measured have no line by that order.
double EvenSweeps::contradiction_of(Time stamp, Time first, Time last) {
  const double gap = to_seconds(first - last_end_);
  gap_ += (gap - gap_) / std::clamp(static_cast<double>(count_), 1.0, recent);
  const bool overlaps = gap < -least_overlap && gap < gap_ - least_overlap;
  last_end_ = last;
  return stamp < last_stamp_ ? -1 : overlaps ? 1 : 0;
}

// One that is late is of the time when it was due. When several do not fit, the clock has been set.
std::optional<Time> EvenSweeps::off_line(Time stamp, Time predicted, double surprise) {
  if (!is_used_ || ++strangers_ == too_many) {
    restart(stamp);
    return std::nullopt;
  }
  if (surprise < 0) return std::nullopt;
  expected_ = predicted;
  last_stamp_ = stamp;
  return predicted;
}

// A straight line by least squares, recursively.
void EvenSweeps::learn(Time stamp, Time predicted, double steps, double contradiction) {
  strangers_ = 0;
  ++count_;
  const double n = std::min(static_cast<double>(count_), memory);
  const double surprise = to_seconds(stamp - predicted);
  const double step = to_seconds(stamp - last_stamp_) - steps * period_;
  expected_ = predicted + from_seconds(2 * (2 * n - 1) / (n * (n + 1)) * surprise);
  period_ += 6 / (n * (n + 1)) * surprise / steps;
  last_stamp_ = stamp;
  if (count_ <= 3) return;
  const double share = 1 / std::min(n, recent);
  deviation2_ += share * (square(surprise) - deviation2_);
  step2_ += share * (square(step) - step2_);
  alternating_ += share * (step * step_before_ - alternating_);
  contradictions_ += share * (contradiction - contradictions_);
  step_before_ = step_;
  step_ = step;
}

void EvenSweeps::decide() {
  const bool is_line = count_ >= fewest && deviation2_ > square(even_enough) && deviation2_ < share_of_steps * step2_ &&
                       alternating_ < taking_turns * step2_;
  is_used_ = is_line && contradictions_ > (is_used_ ? contented : contradicting);
}

Time EvenSweeps::follow(Time stamp, Time first, Time last) {
  const double contradiction = contradiction_of(stamp, first, last);
  const double limit = to_seconds(last - first) / 2;  // of a sweep; farther from the line no stamp can be
  const double passed = to_seconds(stamp - expected_);
  if (count_ == 0 || !(std::abs(passed) < memory * std::max(limit, least_overlap)) || (count_ > 1 && !(period_ > 0))) {
    restart(stamp);
    return stamp;
  }
  // Sweeps that are missing do not end the line.
  const double steps = count_ > 3 && passed > period_ + limit ? std::round(passed / period_) : 1;
  const Time predicted = expected_ + from_seconds(steps * period_);
  const double surprise = passed - steps * period_;
  const double usual = sigmas * std::sqrt(std::max(deviation2_, square(even_enough)));
  const bool fits = count_ == 1 || std::abs(surprise) < (count_ < fewest ? limit : std::min(limit, usual));
  if (!fits) return off_line(stamp, predicted, surprise).value_or(stamp);
  learn(stamp, predicted, steps, contradiction);
  decide();
  return is_used_ ? expected_ : stamp;
}

void EvenSamples::restart(Time stamp) {
  *this = EvenSamples();
  last_ = given_ = stamp;
  stamps_ = {stamp};
}

void EvenSamples::look_at_step(double step) {
  const double share = 1 / static_cast<double>(std::min(stamps_.size(), most_samples));
  at_once_ += share * ((step < at_once * period_ ? 1 : 0) - at_once_);
  is_used_ = stamps_.size() >= fewest_samples && at_once_ > (is_used_ ? no_more_bursting : bursting);
}

Time EvenSamples::follow(Time stamp) {
  // Of messages that overtake each other, and of clocks that are set, the stamps are those of the sensor.
  if (!last_ || stamp < *last_) {
    restart(stamp);
    return stamp;
  }
  const double step = to_seconds(stamp - *last_), lag = to_seconds(*last_ - *given_);
  const bool is_gap = step > longest_batch;
  if (is_gap) stamps_.clear();
  stamps_.push_back(stamp);
  if (stamps_.size() > most_samples) stamps_.pop_front();
  if (stamps_.size() >= fewest_samples || period_ == 0) {
    const auto steps = static_cast<double>(stamps_.size() - 1);
    if (steps > 0) period_ = to_seconds(stamp - stamps_.front()) / steps;
  }
  look_at_step(step);
  // Where a new burst begins, the one before has ended with its newest sample: what that seems to be late by periods is missing.
  Time before = *given_;
  if (step > 1.5 * period_ && period_ > 0) {
    const double missing = std::floor(lag / period_ + 0.5) * period_;
    before += from_seconds(missing + gain * (lag - missing));
  }
  const Time even = before + from_seconds(period_);
  last_ = stamp;
  given_ = is_used_ && even < stamp && to_seconds(stamp - even) < longest_batch ? even : stamp;
  late_ += (to_seconds(stamp - *given_) - late_) / recent;
  return *given_;
}

}  // namespace kilvo::lab
