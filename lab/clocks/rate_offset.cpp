#include "lab/clocks/rate_offset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kilvo/filter/gap.hpp"

namespace kilvo::lab {
namespace {

// Differences this far apart in time are taken as independent, s.
constexpr double independent = 0.01;
// An offset is found when every other one, but its neighbours, is less likely by this (difference of the logarithms; errors of neighbouring
// samples are alike, so it is large), over so many samples at least.
constexpr double certain = 60, enough = 60;
constexpr int neighbours = 8;              // steps of the grid
constexpr double forgetting = 1.0 / 1000;  // of what the grid has seen, a sample
// How an offset wanders: delays change by a tenth of a millisecond in a second.
constexpr double walk = 1e-4;  // s/sqrt(s)
constexpr double gate = 4;
constexpr int most_refused = 300;

}  // namespace

RateOffset::RateOffset() : reference_(kept, Eigen::Vector3d::Zero()) { waiting_.reserve(4 * kept); }

std::int64_t RateOffset::place_of(Time t) const { return static_cast<std::int64_t>(std::floor(to_seconds(t - *origin_) / step)); }

void RateOffset::add_reference(Time t, const Eigen::Vector3d& rate) {
  const double span = last_reference_ ? to_seconds(t - *last_reference_) : 2 * blind_gap;
  if (span <= 0 && span > -blind_gap) return;
  if (std::abs(span) > blind_gap) {
    // What came before the gap, or before a recording was played again, is of no use. The offset is of the clocks, and stays.
    origin_ = t;
    end_ = 0;
    first_waiting_ = 0;
    waiting_.clear();
  } else {
    for (; place_of(t) >= end_; ++end_) {
      const double share = std::clamp((static_cast<double>(end_) * step - to_seconds(*last_reference_ - *origin_)) / span, 0.0, 1.0);
      reference_[static_cast<std::size_t>(end_) % kept] = last_rate_ + share * (rate - last_rate_);
    }
    const double decay = std::exp(-span);
    lively_reference_ = std::max(rate.norm(), decay * lively_reference_);
  }
  last_reference_ = t;
  last_rate_ = rate;
  const double reach = is_found_ ? offset_ + 4 * step : (most + 2) * step;
  while (first_waiting_ < waiting_.size() && to_seconds(t - waiting_[first_waiting_].t) > reach) {
    const Sample& sample = waiting_[first_waiting_++];
    if (is_found_) {
      refine(sample);
    } else {
      try_all(sample);
      decide();
    }
  }
  if (first_waiting_ == waiting_.size()) {
    first_waiting_ = 0;
    waiting_.clear();
  }
}

void RateOffset::add(Time t, std::span<const Eigen::Vector3d> candidates) {
  if (last_ && t > *last_ && to_seconds(t - *last_) < independent) return;
  Sample sample;
  sample.t = t;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& rate : candidates) {
    if (sample.count == most_candidates || !rate.allFinite()) return;
    sample.rate[sample.count++] = rate;
    least = std::min(least, rate.norm());
  }
  if (sample.count == 0 || waiting_.size() == waiting_.capacity()) return;
  lively_other_ = std::max(least, std::exp(last_ ? -std::abs(to_seconds(t - *last_)) : 0.0) * lively_other_);
  last_ = t;
  waiting_.push_back(sample);
}

// The least squared difference of a candidate to a rate.
double RateOffset::distance(const Sample& sample, const Eigen::Vector3d& rate, Eigen::Vector3d* difference) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sample.count; ++i) {
    const Eigen::Vector3d d = sample.rate[i] - rate;
    if (d.squaredNorm() >= least) continue;
    least = d.squaredNorm();
    if (difference != nullptr) *difference = d;
  }
  return least;
}

std::optional<Eigen::Vector3d> RateOffset::reference_at(Time t, Eigen::Vector3d* slope) const {
  if (!origin_) return std::nullopt;
  const std::int64_t place = place_of(t);
  if (place < std::max<std::int64_t>(1, end_ - static_cast<std::int64_t>(kept) + 2) || place + 2 >= end_) return std::nullopt;
  const double share = to_seconds(t - *origin_) / step - static_cast<double>(place);
  const Eigen::Vector3d here = reference(place), next = reference(place + 1);
  if (slope != nullptr) *slope = ((1 - share) * (next - reference(place - 1)) + share * (reference(place + 2) - here)) / (2 * step);
  return here + share * (next - here);
}

void RateOffset::try_all(const Sample& sample) {
  if (!reference_at(sample.t - from_seconds(most * step), nullptr) || !reference_at(sample.t + from_seconds(most * step), nullptr)) return;
  samples_ = (1 - forgetting) * samples_ + 1;
  for (int k = -most; k <= most; ++k) {
    double& sum = squares_[static_cast<std::size_t>(k + most)];
    sum = (1 - forgetting) * sum + distance(sample, *reference_at(sample.t + from_seconds(k * step), nullptr), nullptr);
  }
}

void RateOffset::decide() {
  if (samples_ < enough) return;
  const auto best = std::ranges::min_element(squares_) - squares_.begin();
  double others = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= 2 * most; ++k) {
    if (std::abs(k - static_cast<int>(best)) > neighbours) others = std::min(others, squares_[static_cast<std::size_t>(k)]);
  }
  const double variance = squares_[static_cast<std::size_t>(best)] / (3 * samples_);  // of each axis
  if (!(others - squares_[static_cast<std::size_t>(best)] > 2 * certain * variance)) return;
  is_found_ = true;
  offset_ = (static_cast<double>(best) - most) * step;
  variance_ = step * step;  // the jitter of delays is no larger
  noise_ = variance;
}

// other(t) = reference(t + offset): what is left over is the slope times what the offset is wrong by.
void RateOffset::refine(const Sample& sample) {
  variance_ += walk * walk * independent;
  Eigen::Vector3d slope, difference;
  const auto rate = reference_at(sample.t + from_seconds(offset_), &slope);
  if (!rate) return;
  const double squared = distance(sample, *rate, &difference);
  const double expected = 3 * noise_ + slope.squaredNorm() * variance_;
  if (squared > gate * gate * expected) {
    // Nothing fits any more: another clock, or it was the wrong one.
    if (++refused_ <= most_refused) return;
    squares_.fill(0);
    samples_ = 0;
    refused_ = 0;
    is_found_ = false;
    return;
  }
  refused_ = 0;
  noise_ += forgetting * (std::max(0.0, squared - slope.squaredNorm() * variance_) / 3 - noise_);
  const double gain = variance_ / (slope.squaredNorm() * variance_ + noise_);
  offset_ = std::clamp(offset_ + gain * slope.dot(difference), -most * step, most * step);
  variance_ *= 1 - gain * slope.squaredNorm();
}

}  // namespace kilvo::lab
