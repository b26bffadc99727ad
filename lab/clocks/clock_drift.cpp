#include "lab/clocks/clock_drift.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo::lab {
namespace {

// Stretches in a block, whose median stands against stretches that had wrong stamps or a busy computer; blocks that a line needs, and at
// most.
constexpr std::size_t per_block = 5, fewest_blocks = 5, most_blocks = 60;
// A line changes the delay by so much more than blocks scatter about it, and by so much, s, or there is none. Delays that step are no line.
constexpr double clear = 20, least_change = 2e-3;
// No oscillator is off by more. What grows faster is a queue.
constexpr double most_drift = 3e-4;

}  // namespace

void ClockDrift::add(Time at, double delay) {
  if (newest_.empty() && blocks_.empty()) begin_ = at;
  newest_.push_back({to_seconds(at - begin_), delay});
  if (newest_.size() < per_block) return;
  std::ranges::nth_element(newest_, newest_.begin() + per_block / 2, {}, &Block::delay);
  const double median = newest_[per_block / 2].delay;
  newest_.clear();
  add_block({to_seconds(at - begin_), median});
}

void ClockDrift::add_block(const Block& block) {
  const double passed = blocks_.empty() ? 0 : block.at - blocks_.back().at;
  blocks_.push_back(block);
  if (blocks_.size() > most_blocks) blocks_.pop_front();
  rate_ = 0;
  if (blocks_.size() < fewest_blocks) return;
  double t = 0, d = 0, tt = 0, td = 0, residual2 = 0;
  const auto n = static_cast<double>(blocks_.size());
  for (const Block& b : blocks_) t += b.at / n, d += b.delay / n;
  for (const Block& b : blocks_) tt += (b.at - t) * (b.at - t), td += (b.at - t) * (b.delay - d);
  const double slope = td / tt;
  for (const Block& b : blocks_) residual2 += std::pow(b.delay - d - slope * (b.at - t), 2) / (n - 2);
  const double change = std::abs(slope) * (blocks_.back().at - blocks_.front().at);
  if (!(change > std::max(least_change, clear * std::sqrt(residual2))) || std::abs(slope) > most_drift) return;
  rate_ = -slope;
  correction_ += slope * passed;
}

}  // namespace kilvo::lab
