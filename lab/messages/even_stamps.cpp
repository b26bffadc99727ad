#include "lab/messages/even_stamps.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo::lab {
namespace {

// A stamp contradicts the one before by being too near. One that goes back is of a message that was overtaken: messages that do not come in
// the order in which they were measured have no line by that order.
constexpr double contradicts = 1, was_overtaken = -1, agrees = 0;
// Messages that the line is laid through (an oscillator keeps its period for a minute), and that statistics are of.
constexpr double memory = 600, recent = 150;
constexpr std::uint64_t fewest = 20;
// What is more even than this needs no help, s; nor do sweeps overlap that begin earlier by less (beams are fired in groups).
constexpr double even_enough = 1e-4, least_overlap = 5e-5;
// Stamps that scatter about a line contradict each other so often: by chance alone a third of them.
constexpr double contradicting = 0.1;
// Steps between stamps that scatter about a line have twice their variance; those of a sensor that itself scatters have less than the line.
constexpr double share_of_steps = 0.75;
// Standard deviations beyond which a stamp does not fit, and how many in a row begin another line (of samples, those of a batch).
constexpr double sigmas = 6;
constexpr double too_many = 3;
// s; no batch of samples waits for longer.
constexpr double longest_batch = 0.1;

double square(double x) { return x * x; }

}  // namespace

void EvenStamps::restart(Time stamp) {
  expected_ = last_stamp_ = stamp;
  period_ = 0;
  count_ = 1;
  strangers_ = 0;
  deviation2_ = step2_ = late_ = contradictions_ = 0;
}

bool EvenStamps::is_even() const { return count_ >= fewest && deviation2_ > square(even_enough) && contradictions_ > contradicting; }

std::optional<double> EvenStamps::scatter() const { return is_even() ? std::optional(std::sqrt(deviation2_)) : std::nullopt; }

Time EvenStamps::follow_sweep(Time stamp, Time first, Time last) {
  const bool overlaps = to_seconds(last_end_ - first) > least_overlap;
  const bool goes_back = last < last_end_;
  last_end_ = last;
  const auto even = follow(stamp, goes_back ? was_overtaken : overlaps ? contradicts : agrees, to_seconds(last - first) / 2);
  return even && deviation2_ < share_of_steps * step2_ ? *even : stamp;
}

Time EvenStamps::follow_sample(Time stamp) {
  const double since = to_seconds(stamp - last_end_);
  last_end_ = stamp;
  const auto even = follow(stamp, since < 0 ? was_overtaken : since < period_ / 2 ? contradicts : agrees, longest_batch);
  // Delays between none and the longest have this mean.
  return even ? *even - from_seconds(std::sqrt(3 * deviation2_)) : stamp;
}

std::optional<Time> EvenStamps::follow(Time stamp, double contradiction, double limit) {
  if (count_ == 0) {
    restart(stamp);
    return std::nullopt;
  }
  // Messages that are missing do not end the line.
  const double passed = to_seconds(stamp - expected_);
  const double steps = count_ > 3 && passed > period_ + limit ? std::round(passed / period_) : 1;
  const Time predicted = expected_ + from_seconds(steps * period_);
  const double surprise = passed - steps * period_;
  const double usual = sigmas * std::sqrt(std::max(deviation2_, square(even_enough)));
  const double allowed = count_ < fewest ? limit : std::min(limit, usual);
  if (count_ > 1 && std::abs(surprise) > allowed) {
    if (!is_even()) restart(stamp);
    if (count_ == 1 || surprise < 0) return std::nullopt;
    // One that is late is of the time when it was due; when several are, some are missing, or the clock has been set.
    expected_ = predicted;
    last_stamp_ = stamp;
    if (++strangers_ < std::max(too_many, limit / period_)) return expected_;
    const double missing = std::round(surprise / period_);
    if (missing == 0) restart(stamp);
    strangers_ = 0;
    expected_ += from_seconds(missing * period_);
    return expected_;
  }
  strangers_ = 0;
  ++count_;
  // A straight line by least squares, recursively.
  const double n = std::min(static_cast<double>(count_), memory);
  const double step = to_seconds(stamp - last_stamp_) - steps * period_;
  expected_ = predicted + from_seconds(2 * (2 * n - 1) / (n * (n + 1)) * surprise);
  period_ += 6 / (n * (n + 1)) * surprise / steps;
  last_stamp_ = stamp;
  const double share = 1 / std::min(n, recent);
  if (count_ > 3) {
    deviation2_ += share * (square(surprise) - deviation2_);
    step2_ += share * (square(step) - step2_);
    late_ += share * (surprise - late_);
    contradictions_ += share * (contradiction - contradictions_);
  }
  if (count_ >= fewest && !(period_ > 0)) restart(stamp);  // no clock
  count_what_is_missing();
  return is_even() ? std::optional(expected_) : std::nullopt;
}

/// A message that is missing where stamps scatter by periods shows in the mean alone: all that follow seem late.
void EvenStamps::count_what_is_missing() {
  if (static_cast<double>(count_) < recent || std::abs(late_) < period_ / 2 || square(late_) < square(3) * deviation2_ / recent) return;
  expected_ += from_seconds(std::round(late_ / period_) * period_);
  late_ = 0;
}

}  // namespace kilvo::lab
