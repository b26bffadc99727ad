#include "apps/node/node.hpp"

#include <filesystem>
#include <fmt/core.h>

#include "lab/mapping/output_error.hpp"

namespace kilvo::node {
namespace {

constexpr auto diagnostics_period = std::chrono::milliseconds(500);

std::array<bool, sensor_count> configured(const lab::Settings& settings) {
  std::array<bool, sensor_count> out{};
  for (std::size_t s = 0; s < sensor_count; ++s) out[s] = settings.has(static_cast<Sensor>(s));
  return out;
}

}  // namespace

lab::Settings load_settings(const std::string& config, const std::vector<std::string>& overrides) {
  lab::Settings settings = lab::load_settings(config, overrides);
  std::vector<Sensor> used;
  for (const Sensor sensor : all_sensors) {
    if (settings.has(sensor)) used.push_back(sensor);
  }
  if (used.empty() || used.front() != Sensor::imu)
    throw lab::ConfigError(config + ": imu.topic is missing: nothing is estimated without the IMU");
  lab::require_complete(settings, used);
  if (!settings.given.contains("estimator.wait_for_images")) settings.estimator.wait_for_images = false;
  if (!settings.given.contains("estimator.threads")) settings.estimator.threads = 1;
  return settings;
}

Node::Node(const Options& options, const lab::Settings& settings, Outlet outlet, SensorInputs::Say say)
    : options_(options),
      settings_(settings),
      say_(std::move(say)),
      outlet_(std::move(outlet)),
      base_(options_, settings_),
      states_(options_, settings_, base_, outlet_),
      map_(options_.map_frame, settings_.mapping, outlet_),
      description_(settings_.robot, {settings_.leg_clock.clock != "stamp", options_.no_deskew || !settings_.clouds.deskew},
                   lab::DescriptionWatch::Judging::live),
      inputs_(
          settings_, options_.no_deskew, [this](Measurement m, Time arrived) { push(std::move(m), arrived); }, say_) {
  try {
    life_ = begin_life();
    if (settings_.has(Sensor::legs)) kinematics_.emplace(settings_.robot);
  } catch (const std::invalid_argument& error) {
    throw lab::ConfigError(fmt::format("{}: {}", options_.config, error.what()));
  }
}

Node::Life::Life(const lab::Settings& settings, live::LiveRunner::Sinks sinks)
    : estimator(settings.robot, settings.estimator, configured(settings)),
      runner(estimator, settings.robot, settings.estimator, configured(settings), settings.live, std::move(sinks)) {}

std::unique_ptr<Node::Life> Node::begin_life() {
  return std::make_unique<Life>(settings_, live::LiveRunner::Sinks{[this](Output output) { states_.take(output); },
                                                                   [this](Output output) {
                                                                     states_.note_events(output);
                                                                     if (output.is_sweep || output.is_image) map_.take(std::move(output));
                                                                   }});
}

void Node::end_life() {
  if (!life_) return;
  life_->runner.stop();
  const live::LiveStatistics& s = life_->runner.statistics();
  say_(fmt::format("sample to pose: p50 {:.3f} ms, p99 {:.3f} ms, p99.9 {:.3f} ms, {} samples; legs given up: {}, outputs: {}",
                   1e3 * s.latency.quantile(0.5), 1e3 * s.latency.quantile(0.99), 1e3 * s.latency.quantile(0.999), s.latency.count(),
                   s.dropped[static_cast<std::size_t>(Sensor::legs)], s.dropped_outputs));
  life_.reset();
}

void Node::push(Measurement m, Time) {
  if (const auto* joints = std::get_if<JointSample>(&m)) {
    if (!is_of_this_robot(*joints)) return;
    base_.take(*joints);
  }
  description_.take(m);
  const std::shared_lock lock(life_mutex_);
  if (life_) life_->runner.push(std::move(m));
}

bool Node::is_of_this_robot(const JointSample& sample) {
  const auto why = kinematics_->mismatch(sample);
  bool is_new = false;
  {
    const std::lock_guard lock(mismatch_mutex_);
    is_new = why && *why != legs_mismatch_;
    legs_mismatch_ = why.value_or("");
  }
  if (is_new) say_(options_.config + ": " + *why);
  return !why;
}

Condition Node::condition() const {
  Condition out;
  out.now = SteadyClock::now();
  for (std::size_t s = 0; s < sensor_count; ++s) out.inputs[s] = inputs_.state(static_cast<Sensor>(s));
  out.rates = rates_of(settings_.robot);
  out.estimate = states_.newest();
  {
    const std::shared_lock lock(life_mutex_);
    if (life_) {
      out.seen = life_->runner.seen();
      out.waiting_for = life_->runner.waiting_for();
    }
  }
  out.base_waits_for = base_.waiting_for();
  out.clouds_given_up = map_.given_up();
  out.wrong = wrong_;
  const std::lock_guard lock(mismatch_mutex_);
  out.legs_mismatch = legs_mismatch_;
  return out;
}

void Node::tick(Time time) {
  states_.publish_path();
  for (lab::WrongDescription& wrong : description_.news()) {
    say_(fmt::format("the description of the robot: {}; {}", wrong.finding.text, wrong.finding.remedy));
    if (wrong.spoils) states_.distrust();
    wrong_.push_back(std::move(wrong));
  }
  const Condition now = condition();
  Diagnostics message;
  message.status = statuses(now);
  // What changes is reported at once.
  const std::string essence_now = essence(message.status);
  if (essence_now == last_essence_ && now.now - last_diagnostics_ < diagnostics_period) return;
  if (essence_now != last_essence_) say_(message.status.front().message);
  last_essence_ = essence_now;
  last_diagnostics_ = now.now;
  message.header.stamp = time;
  outlet_.publish(Topic::diagnostics, time, message);
}

void Node::stop() {
  const std::unique_lock lock(life_mutex_);
  end_life();
}

std::vector<Sensor> Node::sensors_to_pause() const {
  std::vector<Sensor> out;
  for (const Sensor sensor : {Sensor::legs, Sensor::lidar, Sensor::camera}) {
    if (settings_.has(sensor)) out.push_back(sensor);
  }
  return out;
}

Answer Node::save_map() {
  const std::string path = std::filesystem::absolute(options_.map_file).string();
  Answer answer;
  try {
    const std::size_t points = map_.save(path);
    answer = {true, fmt::format("{} points in {}", points, path)};
  } catch (const lab::OutputError& error) {
    answer.message = error.what();
  }
  say_("save_map: " + answer.message);
  return answer;
}

Answer Node::reset() {
  const std::unique_lock lock(life_mutex_);  // measurements wait in their queues
  end_life();
  states_.clear();
  map_.clear();
  life_ = begin_life();
  say_("reset");
  return {true, "estimator and map begin anew"};
}

Answer Node::pause(Sensor sensor, bool paused) {
  inputs_.pause(sensor, paused);
  const Answer answer{true, fmt::format("{} {}", name_of(sensor), paused ? "is left out" : "is used again")};
  say_(answer.message);
  return answer;
}

}  // namespace kilvo::node
