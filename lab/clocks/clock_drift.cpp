#include "lab/clocks/clock_drift.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>

namespace kilvo::lab {
namespace {

// Stretches in a block, whose median stands against stretches that had wrong stamps or a busy computer; blocks that a line needs, and at
// most.
constexpr std::size_t per_block = 5, fewest_blocks = 10, most_blocks = 60;
// A block takes no longer, s.
constexpr double longest_block = 30;
// A line changes the delay by so much more than blocks scatter about it, and by so much, s, or there is none; and as fast in its first half
// as in its second but for such a share. Delays that step, or rise until a computer is warm, are no line.
constexpr double clear = 20, least_change = 4e-3, straight = 0.3;
// No oscillator is off by more. What grows faster is a queue.
constexpr double most_drift = 3e-4;

struct Line {
  double slope, scatter, span;
};

template <class Blocks>
Line line_through(const Blocks& blocks) {
  double t = 0, d = 0, tt = 0, td = 0, residual2 = 0;
  const auto n = static_cast<double>(blocks.size());
  for (const auto& b : blocks) t += b.at / n, d += b.delay / n;
  for (const auto& b : blocks) tt += (b.at - t) * (b.at - t), td += (b.at - t) * (b.delay - d);
  const double slope = td / tt;
  for (const auto& b : blocks) residual2 += std::pow(b.delay - d - slope * (b.at - t), 2) / (n - 2);
  return {slope, std::sqrt(residual2), blocks.back().at - blocks.front().at};
}

}  // namespace

void ClockDrift::add(Time at, double delay) {
  if (at < newest_until_) *this = ClockDrift();  // another recording
  if (newest_.empty() && blocks_.empty()) begin_ = at;
  newest_until_ = at;
  const double t = to_seconds(at - begin_);
  if (!newest_.empty() && t - newest_.front().at > longest_block) newest_.clear();
  newest_.push_back({t, delay});
  if (newest_.size() < per_block) return;
  std::ranges::nth_element(newest_, newest_.begin() + per_block / 2, {}, &Block::delay);
  const double median = newest_[per_block / 2].delay;
  newest_.clear();
  add_block({t, median});
}

std::optional<double> ClockDrift::slope() const {
  if (blocks_.size() < fewest_blocks) return std::nullopt;
  const auto middle = blocks_.begin() + static_cast<std::ptrdiff_t>(blocks_.size() / 2);
  const Line all = line_through(blocks_), first = line_through(std::ranges::subrange(blocks_.begin(), middle)),
             second = line_through(std::ranges::subrange(middle, blocks_.end()));
  const bool is_line = std::abs(all.slope) * all.span > std::max(least_change, clear * all.scatter) &&
                       std::abs(first.slope - second.slope) < straight * std::abs(all.slope) && std::abs(all.slope) < most_drift;
  return is_line ? std::optional(all.slope) : std::nullopt;
}

void ClockDrift::add_block(const Block& block) {
  blocks_.push_back(block);
  if (blocks_.size() > most_blocks) blocks_.pop_front();
  const auto drift = slope();
  if (drift) {
    // A drift that was known before has gone on while delays that stepped hid it.
    if (known_until_) correction_ += *drift * (block.at - *known_until_);
    known_until_ = block.at;
  }
  rate_ = -drift.value_or(0);
}

}  // namespace kilvo::lab
