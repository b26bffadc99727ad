#include "apps/live/live_runner.hpp"

#include <algorithm>
#include <utility>

#include "apps/live/thread_settings.hpp"
#include "kilvo/estimator/fault.hpp"
#include "kilvo/estimator/stopwatch.hpp"

namespace kilvo::live {
namespace {

constexpr std::size_t most_samples = 4096, most_outputs = 4096, most_slow_outputs = 64, most_raw = 8192;
constexpr double deadline = 1e-3;  // s
// Without sweeps and images, a fork so often; what the user is told, so often.
constexpr Duration fork_period = std::chrono::milliseconds(100);
constexpr auto tell_period = std::chrono::milliseconds(500);

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

template <class Raw>
Time stamp_of_raw(const Raw& raw) {
  return std::visit([](const auto& s) { return s.t; }, raw);
}

}  // namespace

LiveRunner::LiveRunner(Estimator& estimator, const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used,
                       const lab::LiveConfig& live, Sinks sinks)
    : estimator_(estimator),
      used_(used),
      config_(live),
      sinks_(std::move(sinks)),
      samples_(most_samples),
      forks_({Forerunner(robot, config), std::nullopt}),
      outputs_(most_outputs) {
  if (used_[static_cast<std::size_t>(Sensor::legs)]) {
    fast_kinematics_.emplace(robot);
    slow_kinematics_.emplace(robot);
  }
  waiting_for_ = estimator_.waiting_for();
  output_ = std::thread([this] { run_output(); });
  slow_ = std::thread([this] { run_slow(); });
  fast_ = std::thread([this] { run_fast(); });
}

LiveRunner::~LiveRunner() { end(); }

void LiveRunner::push(Measurement m) {
  const std::lock_guard lock(pushing_);
  if (input_ended_) return;
  const Clock::time_point now = Clock::now();
  const auto* imu = std::get_if<ImuSample>(&m);
  const auto* joints = std::get_if<JointSample>(&m);
  const auto s = static_cast<std::size_t>(sensor_of(m));
  if (used_[s] && (imu != nullptr || joints != nullptr)) {
    if (Sample* slot = samples_.vacant()) {
      slot->is_imu = imu != nullptr;
      if (imu != nullptr) slot->imu = *imu;
      if (joints != nullptr) slot->joints = *joints;
      slot->at = now;
      samples_.push();
      for_fast_.post();
    } else {
      ++not_taken_[s];
    }
  }
  ++pushed_;
  backlog_.push({std::move(m), now});
}

bool LiveRunner::is_idle() const {
  return processed_ + backlog_.given_up() == pushed_ && !forks_.has_news() && samples_.size() == 0 && outputs_.size() == 0 &&
         sweeps_out_ == sweeps_carried_;
}

void LiveRunner::stop() {
  end();
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void LiveRunner::end() {
  if (!fast_.joinable()) return;
  {
    const std::lock_guard lock(pushing_);
    input_ended_ = true;
  }
  backlog_.close();
  slow_.join();
  slow_ended_ = true;
  for_fast_.post();
  fast_.join();
  fast_ended_ = true;
  for_output_.post();
  output_.join();
  const auto given_up = backlog_.dropped();
  for (std::size_t s = 0; s < sensor_count; ++s) statistics_.dropped[s] += given_up[s] + not_taken_[s];
  statistics_.dropped_outputs += slow_outputs_dropped_;
  statistics_.deepest["slow"] = backlog_.deepest();
}

Statistics LiveRunner::seen() const {
  const std::lock_guard lock(seen_mutex_);
  return seen_;
}

std::string LiveRunner::waiting_for() const {
  const std::lock_guard lock(seen_mutex_);
  return waiting_for_;
}

void LiveRunner::warn(const std::string& text) {
  if (text.empty()) return;
  const std::lock_guard lock(seen_mutex_);
  statistics_.warnings.push_back("live: " + text);
}

// ---- the fast thread: nothing here waits for another thread, or allocates

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
  if (fast_raw_.size() >= most_raw) fast_raw_.pop_front();
  Forerunner& runner = forks_.front().runner;
  if (sample.is_imu) {
    fast_raw_.push_back(sample.imu);
    if (runner.push(sample.imu)) emit(sample.at);
    return;
  }
  // Behind by so much, nobody waits for the answer any more.
  if (seconds_since(sample.at) > config_.max_latency) {
    ++statistics_.dropped[static_cast<std::size_t>(Sensor::legs)];
    return;
  }
  if (fault_of(sample.joints) != nullptr) return;
  const auto known = fast_kinematics_->feet(sample.joints);
  const auto* feet = std::get_if<Feet>(&known);
  if (feet == nullptr) return;
  fast_raw_.push_back(*feet);
  if (runner.push(*feet)) emit(sample.at);
}

// The estimator's newest state, with what came since.
void LiveRunner::take_over() {
  if (!forks_.fetch()) return;
  Fork& fork = forks_.front();
  const Time known = fork.runner.known();
  while (!fast_raw_.empty() && stamp_of_raw(*fast_raw_.begin()) < known) fast_raw_.pop_front();
  for (const Raw& raw : fast_raw_) std::visit([&](const auto& s) { fork.runner.push(s); }, raw);
  if (fork.corrected) statistics_.correction.add(seconds_since(*fork.corrected));
  // That there is no pose any more is said once.
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

// ---- the slow thread

void LiveRunner::run_slow() {
  warn(settle_thread({"kilvo-slow", 0, config_.slow_core}));
  std::vector<Arrival> batch;
  std::vector<Output> outputs;
  while (backlog_.take(batch)) {
    for (const Arrival& a : batch) keep_raw(a.m);
    for (Arrival& a : batch) {
      outputs.clear();
      estimator_.push(std::move(a.m), outputs);
      if (!outputs.empty()) answer(outputs, a.at);
      ++processed_;
    }
    if (Clock::now() - told_ >= tell_period) tell();
  }
  outputs = estimator_.finish();
  pass_on(outputs);
  tell();
  const std::lock_guard lock(seen_mutex_);
  statistics_.cpu_seconds["slow"] = thread_cpu_seconds();
}

void LiveRunner::answer(std::vector<Output>& outputs, Clock::time_point since) {
  const Modality modality = outputs.back().modality;
  const Time now = outputs.back().t;
  const bool corrected = pass_on(outputs);
  const bool due = !last_fork_ || now - *last_fork_ >= fork_period || last_modality_ != modality;
  last_modality_ = modality;
  if (!corrected && !due) return;
  hand_over(corrected ? std::optional(since) : std::nullopt);
  last_fork_ = now;
}

void LiveRunner::keep_raw(const Measurement& m) {
  if (slow_raw_.size() >= most_raw) slow_raw_.pop_front();
  if (const auto* imu = std::get_if<ImuSample>(&m)) slow_raw_.push_back(*imu);
  const auto* joints = std::get_if<JointSample>(&m);
  if (joints == nullptr || !slow_kinematics_ || fault_of(*joints) != nullptr) return;
  const auto known = slow_kinematics_->feet(*joints);
  if (const auto* feet = std::get_if<Feet>(&known)) slow_raw_.push_back(*feet);
}

// Sweeps and images; the states in between are the fast thread's. True when there was one.
bool LiveRunner::pass_on(std::vector<Output>& outputs) {
  bool any = false;
  for (Output& output : outputs) {
    if (!output.is_sweep && !output.is_image) continue;
    any = true;
    const std::lock_guard lock(slow_outputs_mutex_);
    if (slow_outputs_.size() < most_slow_outputs || input_ended_) {
      slow_outputs_.push_back(std::move(output));
      ++sweeps_out_;
    } else {
      ++slow_outputs_dropped_;
    }
  }
  if (any) for_output_.post();
  return any;
}

void LiveRunner::hand_over(std::optional<Clock::time_point> corrected) {
  Fork& fork = forks_.back();
  if (!estimator_.fork(fork.runner)) return;
  fork.corrected = corrected;
  const Time known = fork.runner.known();
  while (!slow_raw_.empty() && stamp_of_raw(*slow_raw_.begin()) < known) slow_raw_.pop_front();
  for (const Raw& raw : slow_raw_) std::visit([&](const auto& s) { fork.runner.push(s); }, raw);
  forks_.publish();
  for_fast_.post();
}

void LiveRunner::tell() {
  told_ = Clock::now();
  const std::lock_guard lock(seen_mutex_);
  seen_ = estimator_.statistics();
  seen_.health = estimator_.health().streams();
  waiting_for_ = estimator_.waiting_for();
}

// ---- the third thread

void LiveRunner::carry(const std::function<void(Output)>& sink, Output output) {
  if (failed_) return;
  try {
    sink(std::move(output));
  } catch (...) {
    failure_ = std::current_exception();
    failed_ = true;
  }
}

void LiveRunner::run_output() {
  settle_thread({"kilvo-output", 0, -1});
  std::vector<Output> slow;
  bool ended = false;
  while (!ended) {
    for_output_.wait();
    ended = fast_ended_;
    {
      const std::lock_guard lock(slow_outputs_mutex_);
      slow.swap(slow_outputs_);
    }
    for (Output& output : slow) {
      carry(sinks_.sweep, std::move(output));
      ++sweeps_carried_;
    }
    slow.clear();
    while (Output* output = outputs_.front()) {
      carry(sinks_.state, std::move(*output));
      outputs_.pop();
    }
  }
  const std::lock_guard lock(seen_mutex_);
  statistics_.cpu_seconds["output"] = thread_cpu_seconds();
}

}  // namespace kilvo::live
