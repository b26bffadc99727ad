// The fast thread of the live runner: nothing here waits for another thread, or allocates once it is warm.
#include <algorithm>
#include <utility>

#include "apps/live/live_runner.hpp"
#include "apps/live/raw.hpp"
#include "apps/live/thread_settings.hpp"
#include "kilvo/input/health.hpp"

namespace kilvo::live {
namespace {

constexpr double deadline = 1e-3;  // s

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

}  // namespace

void LiveRunner::run_fast() {
  warn(settle_thread({"kilvo-fast", config_.priority, config_.fast_core}));
  std::size_t deepest = 0;
  bool ended = false;
  while (!ended) {
    for_fast_.wait();
    ended = slow_ended_;
    take_over();
    deepest = std::max(deepest, samples_.size());
    while (const Sample* sample = samples_.front()) {
      take(*sample);
      samples_.pop();
      take_over();
    }
  }
  const std::lock_guard lock(seen_mutex_);
  statistics_.deepest["fast"] = deepest;
  statistics_.cpu_seconds["fast"] = thread_cpu_seconds();
}

void LiveRunner::take(const Sample& sample) {
  LivePropagator& runner = forks_.front().runner;
  if (sample.is_imu) {
    fast_raw_.keep(sample.imu);
    if (runner.push(sample.imu)) emit(sample.at);
    return;
  }
  // Behind by so much, nobody waits for the answer any more.
  if (seconds_since(sample.at) > config_.max_latency) {
    ++statistics_.dropped[static_cast<std::size_t>(Sensor::legs)];
    return;
  }
  if (fault_of(sample.joints)) return;
  const auto known = fast_kinematics_->feet(sample.joints);
  const auto* feet = std::get_if<Feet>(&known);
  if (feet == nullptr) return;
  fast_raw_.keep(*feet);
  const bool is_due = last_output_ && runner.started() && !lost_ && feet->t > newest_legs_;
  newest_legs_ = std::max(newest_legs_, feet->t);
  legs_heard_ += is_due ? 1 : 0;
  if (!runner.push(*feet)) return;
  ++legs_answered_;
  emit(sample.at);
}

// The estimator's newest state, with what came since.
void LiveRunner::take_over() {
  if (!forks_.fetch()) return;
  Fork& fork = forks_.front();
  if (std::exchange(epoch_, fork.runner.epoch()) != fork.runner.epoch()) {
    last_output_.reset();
    newest_legs_ = Time::min();
  }
  fast_raw_.catch_up(fork.runner);
  if (fork.corrected) statistics_.correction.add(seconds_since(*fork.corrected));
  // That there is no pose any more is reported once.
  if (fork.runner.imu_lost() && !std::exchange(lost_, true)) emit(Clock::now());
  lost_ = fork.runner.imu_lost();
}

void LiveRunner::emit(Clock::time_point since) {
  Output output = forks_.front().runner.output();
  if (last_output_ && output.t <= *last_output_) {
    if (!lost_) return;
    output.t = *last_output_ + Duration(1000);
  }
  last_output_ = output.t;
  output.R_LW = forks_.front().R_LW;
  if (Output* slot = outputs_.vacant()) {
    *slot = std::move(output);
    outputs_.push();
    for_output_.post();
  } else {
    ++statistics_.dropped_outputs;
  }
  if (lost_) return;
  const double latency = seconds_since(since);
  statistics_.latency.add(latency);
  if (latency > deadline) ++statistics_.deadline_misses;
}

}  // namespace kilvo::live
