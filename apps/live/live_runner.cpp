#include "apps/live/live_runner.hpp"

#include <cmath>
#include <utility>

#include "apps/live/raw.hpp"
#include "apps/live/thread_settings.hpp"
#include "kilvo/input/health.hpp"

namespace kilvo::live {
namespace {

constexpr std::size_t most_samples = 4096, most_outputs = 4096, most_slow_outputs = 64;
// Without sweeps and images, a fork so often; what the user is told, so often.
constexpr Duration fork_period = std::chrono::milliseconds(100);
constexpr auto tell_period = std::chrono::milliseconds(500);

}  // namespace

LiveRunner::LiveRunner(Estimator& estimator, const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used,
                       const lab::LiveConfig& live, Sinks sinks)
    : estimator_(estimator),
      used_(used),
      config_(live),
      sinks_(std::move(sinks)),
      samples_(most_samples),
      forks_({LivePropagator(robot, config), std::nullopt, std::nullopt}),
      outputs_(most_outputs),
      gravity_align_(config.gravity_align) {
  if (used_[static_cast<std::size_t>(Sensor::legs)]) {
    const bool forces = config.legs.contact == "force";
    fast_kinematics_.emplace(robot, forces);
    slow_kinematics_.emplace(robot, forces);
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
  // What is not to be used the estimator sees as well, and counts.
  const bool usable = used_[s] && !clock_steps_.follow(m);
  note_clock_steps(stamp_of(m));
  if (usable && (imu != nullptr || joints != nullptr)) {
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

void LiveRunner::note_clock_steps(Time imu) {
  if (clock_steps_.count() == statistics_.clock_steps) return;
  statistics_.clock_steps = clock_steps_.count();
  constexpr std::uint64_t most = 10;
  if (clock_steps_.count() > most) return;
  // The estimator, which gets the stamps as they are put right, sees nothing of it.
  const double back = to_seconds(clock_steps_.last());
  const Event event{imu, Sensor::imu, Reason::imu_clock_stepped, std::abs(back), clock_steps_.count(), back > 0 ? "back" : "ahead"};
  warn(text_of(event));
  const std::lock_guard lock(seen_mutex_);
  own_events_.push_back(event);
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
  constexpr double most = 0.9;
  const bool all_taken = statistics_.dropped[static_cast<std::size_t>(Sensor::legs)] == 0;
  if (all_taken && static_cast<double>(legs_answered_) < most * static_cast<double>(legs_heard_)) {
    warn("only " + std::to_string(legs_answered_) + " of " + std::to_string(legs_heard_) +
         " leg samples were answered at once: IMU and legs do not come together");
  }
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
    if (Clock::now() - sweep_noise_ >= tell_period) tell();
  }
  outputs = estimator_.finish();
  level(outputs);
  pass_on(outputs);
  tell();
  const std::lock_guard lock(seen_mutex_);
  statistics_.cpu_seconds["slow"] = thread_cpu_seconds();
}

void LiveRunner::answer(std::vector<Output>& outputs, Clock::time_point since) {
  const Modality modality = outputs.back().modality;
  const Time now = outputs.back().t;
  const bool turned = level(outputs);
  const bool corrected = pass_on(outputs);
  const bool due = turned || !last_fork_ || now < *last_fork_ || now - *last_fork_ >= fork_period || last_modality_ != modality;
  last_modality_ = modality;
  if (!corrected && !due) return;
  hand_over(corrected ? std::optional(since) : std::nullopt);
  last_fork_ = now;
}

void LiveRunner::keep_raw(const Measurement& m) {
  if (const auto* imu = std::get_if<ImuSample>(&m)) slow_raw_.keep(*imu);
  const auto* joints = std::get_if<JointSample>(&m);
  if (joints == nullptr || !slow_kinematics_ || fault_of(*joints)) return;
  const auto known = slow_kinematics_->feet(*joints);
  if (const auto* feet = std::get_if<Feet>(&known)) slow_raw_.keep(*feet);
}

// Each is to be turned by what is known by then. True when that has become known.
bool LiveRunner::level(std::vector<Output>& outputs) {
  if (!gravity_align_) return false;
  bool news = false;
  for (Output& output : outputs) {
    if (std::exchange(levelling_epoch_, output.epoch) != output.epoch) levelling_ = Levelling(Duration::max());
    const bool before = levelling_.turn().has_value();
    levelling_.add(output);
    output.R_LW = levelling_.turn();
    news = news || output.R_LW.has_value() != before;
  }
  return news;
}

// Sweeps, images and events; the states in between are the fast thread's. True when there was a sweep or an image.
bool LiveRunner::pass_on(std::vector<Output>& outputs) {
  bool any = false;
  {
    const std::lock_guard lock(seen_mutex_);
    events_left_.insert(events_left_.end(), own_events_.begin(), own_events_.end());
    own_events_.clear();
  }
  for (Output& output : outputs) {
    const bool corrects = output.is_sweep || output.is_image;
    output.events.insert(output.events.begin(), events_left_.begin(), events_left_.end());
    events_left_.clear();
    if (!corrects && output.events.empty()) continue;
    any = any || corrects;
    const std::lock_guard lock(slow_outputs_mutex_);
    if (slow_outputs_.size() < most_slow_outputs || input_ended_) {
      slow_outputs_.push_back(std::move(output));
      ++sweeps_out_;
    } else {
      events_left_ = std::move(output.events);
      ++slow_outputs_dropped_;
    }
  }
  if (!outputs.empty()) for_output_.post();
  return any;
}

void LiveRunner::hand_over(std::optional<Clock::time_point> corrected) {
  Fork& fork = forks_.back();
  if (!estimator_.fork(fork.runner)) return;
  fork.corrected = corrected;
  fork.R_LW = levelling_.turn();
  slow_raw_.catch_up(fork.runner);
  forks_.publish();
  for_fast_.post();
}

void LiveRunner::tell() {
  sweep_noise_ = Clock::now();
  const std::lock_guard lock(seen_mutex_);
  seen_ = estimator_.statistics();
  seen_.health = estimator_.health().streams();
  waiting_for_ = estimator_.waiting_for();
}

// ---- the third thread

void LiveRunner::carry(const std::function<void(Output)>& sink, Output output) {
  if (failed_) return;
  // Here, and not where it is answered, since nobody waits for it.
  if (const auto turn = std::exchange(output.R_LW, std::nullopt)) Levelling::apply(*turn, output);
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
