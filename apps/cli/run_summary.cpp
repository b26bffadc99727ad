#include "apps/cli/run_summary.hpp"

#include <fmt/core.h>

namespace kilvo::cli {
namespace {

// No humanoid walks, runs or falls faster.
constexpr double absurd_speed = 30;  // m/s
constexpr Duration path_period = std::chrono::milliseconds(100);

}  // namespace

void StageClock::add(std::string_view stage, double microseconds) {
  auto found = stages_.find(stage);
  if (found == stages_.end()) found = stages_.emplace(std::string(stage), Stage{}).first;
  found->second.latency.add(1e-6 * microseconds);
  found->second.sum += 1e-6 * microseconds;
}

std::map<std::string, Quantiles> StageClock::quantiles() const {
  std::map<std::string, Quantiles> out;
  for (const auto& [name, stage] : stages_) {
    const live::Latency& of = stage.latency;
    out[name] = {1e6 * of.quantile(0.5), 1e6 * of.quantile(0.99), 1e6 * of.max(), of.count()};
  }
  return out;
}

double StageClock::total() const {
  double sum = 0;
  for (const auto& [name, stage] : stages_) sum += name == "contact" ? 0 : 1e6 * stage.sum;
  return sum;
}

void RunSummary::add(const Output& output) {
  const StampedState now{output.t, output.x.pose()};
  if (!first_) first_ = last_on_path_ = now;
  if (last_) count_seconds(output, to_seconds(output.t - last_->t));
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

void RunSummary::count_seconds(const Output& output, double dt) {
  modality_seconds_[name_of(output.modality)] += dt;
  constexpr double gap = 0.1, stands = 0.05;  // s, m/s
  const bool coasts = output.modality == Modality::coast;
  if (!coasts) coasting_at_end_ = unmeasured_at_end_ = 0;
  if (dt > gap) return;
  output_seconds_ += dt;
  // A robot that stands is held by that.
  const double unmeasured = coasts && output.x.v.norm() > stands ? dt : 0;
  unmeasured_ += unmeasured;
  unmeasured_at_end_ += unmeasured;
  coasting_at_end_ += coasts ? dt : 0;
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
