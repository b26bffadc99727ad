#include "apps/cli/run_summary.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

namespace kilvo::cli {
namespace {

// No humanoid walks, runs or falls faster.
constexpr double absurd_speed = 30;  // m/s
constexpr Duration path_period = std::chrono::milliseconds(100);

}  // namespace

void StageClock::add(std::string_view stage, double microseconds) {
  auto found = times_.find(stage);
  if (found == times_.end()) found = times_.emplace(std::string(stage), std::vector<float>()).first;
  found->second.push_back(static_cast<float>(microseconds));
}

std::map<std::string, Quantiles> StageClock::quantiles() const {
  std::map<std::string, Quantiles> out;
  for (const auto& [stage, times] : times_) {
    std::vector<float> sorted = times;
    std::ranges::sort(sorted);
    const auto at = [&sorted](double share) {
      return sorted[static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size()))) - 1];
    };
    out[stage] = {at(0.5), at(0.99), sorted.back(), sorted.size()};
  }
  return out;
}

double StageClock::total() const {
  double sum = 0;
  for (const auto& [stage, times] : times_) {
    if (stage == "contact") continue;
    for (const float t : times) sum += static_cast<double>(t);
  }
  return sum;
}

void RunSummary::add(const Output& output) {
  const StampedState now{output.t, output.x.pose()};
  if (!first_) first_ = last_on_path_ = now;
  if (last_) modality_seconds_[name_of(output.modality)] += to_seconds(output.t - last_->t);
  const bool on_path = output.is_sweep || output.t - last_on_path_->t >= (sweeps_ == 0 ? 1 : 3) * path_period;
  if (on_path) {
    path_length_ += (now.T_WI.p - last_on_path_->T_WI.p).norm();
    last_on_path_ = now;
  }
  last_ = now;
  ++outputs_;
  if (output.contacts) count_touchdowns(*output.contacts);
  judge(output);
}

void RunSummary::count_touchdowns(const Contacts& contacts) {
  for (std::size_t side = 0; side < 2; ++side) contact_events_[side] += contacts.on[side] && !on_[side] ? 1 : 0;
  on_ = contacts.on;
}

void RunSummary::judge(const Output& output) {
  if (!absurdity_.empty()) return;
  const double after = to_seconds(output.t - first_->t);
  if (!output.x.p.allFinite() || !output.x.R.matrix().allFinite() || !output.x.v.allFinite()) {
    absurdity_ = fmt::format("a state that is not finite, {:.3f} s after the start", after);
  } else if (output.x.v.norm() > absurd_speed) {
    absurdity_ = fmt::format("a speed of {:.0f} m/s, {:.3f} s after the start", output.x.v.norm(), after);
  }
}

}  // namespace kilvo::cli
