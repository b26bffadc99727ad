#include "apps/ros1/node.hpp"

#include <filesystem>
#include <fmt/core.h>
#include <ros/ros.h>

#include "lab/mapping/output_error.hpp"

namespace kilvo::ros1 {
namespace {

constexpr auto diagnostics_period = std::chrono::milliseconds(500);

std::array<bool, sensor_count> configured(const lab::Settings& settings) {
  std::array<bool, sensor_count> out{};
  for (std::size_t s = 0; s < sensor_count; ++s) out[s] = settings.has(static_cast<Sensor>(s));
  return out;
}

std::array<double, sensor_count> rates_of(const Robot& robot) {
  return {robot.imu.rate, robot.legs.rate, robot.lidar.rate, robot.camera.rate};
}

}  // namespace

Node::Node(const Parameters& parameters, const lab::Settings& settings)
    : parameters_(parameters), settings_(settings), states_(parameters_, settings_), map_(parameters_.names, settings_.mapping) {
  try {
    life_ = begin_life();
    if (settings_.has(Sensor::legs)) kinematics_.emplace(settings_.robot);
  } catch (const std::invalid_argument& error) {
    throw lab::ConfigError(fmt::format("{}: {}", parameters_.config, error.what()));
  }
  diagnostics_ = ros::NodeHandle().advertise<DiagnosticsMessage>("/diagnostics", 10);
  inputs_ = std::make_unique<SensorInputs>(settings_, parameters_.no_deskew, [this](Measurement m) { push(std::move(m)); });
  offer_services();
  std::vector<std::string> services;
  for (const ros::ServiceServer& service : services_) services.push_back(service.getService());
  master_.emplace(std::move(services));
}

Node::Life::Life(const lab::Settings& settings, live::LiveRunner::Sinks sinks)
    : estimator(settings.robot, settings.estimator, configured(settings)),
      runner(estimator, settings.robot, settings.estimator, configured(settings), settings.live, std::move(sinks)) {}

std::unique_ptr<Node::Life> Node::begin_life() {
  return std::make_unique<Life>(settings_, live::LiveRunner::Sinks{[this](Output output) { states_.take(output); },
                                                                   [this](Output output) { map_.take(std::move(output)); }});
}

void Node::end_life() {
  if (!life_) return;
  life_->runner.stop();
  const live::LiveStatistics& s = life_->runner.statistics();
  ROS_INFO_STREAM(
      "kilvo: " << fmt::format("sample to pose: p50 {:.3f} ms, p99 {:.3f} ms, p99.9 {:.3f} ms, {} samples; legs given up: {}, outputs: {}",
                               1e3 * s.latency.quantile(0.5), 1e3 * s.latency.quantile(0.99), 1e3 * s.latency.quantile(0.999),
                               s.latency.count(), s.dropped[static_cast<std::size_t>(Sensor::legs)], s.dropped_outputs));
  life_.reset();
}

void Node::push(Measurement m) {
  if (const auto* joints = std::get_if<JointSample>(&m); joints != nullptr && !is_of_this_robot(*joints)) return;
  const std::shared_lock lock(life_mutex_);
  if (life_) life_->runner.push(std::move(m));
}

bool Node::is_of_this_robot(const JointSample& sample) {
  const auto why = kinematics_->mismatch(sample);
  const std::lock_guard lock(mismatch_mutex_);
  if (why && *why != legs_mismatch_) ROS_ERROR_STREAM("kilvo: " << parameters_.config << ": " << *why);
  legs_mismatch_ = why.value_or("");
  return !why;
}

Condition Node::condition() {
  Condition out;
  out.now = SteadyClock::now();
  for (std::size_t s = 0; s < sensor_count; ++s) out.inputs[s] = inputs_->state(static_cast<Sensor>(s));
  out.rates = rates_of(settings_.robot);
  out.estimate = states_.newest();
  {
    const std::shared_lock lock(life_mutex_);
    if (life_) {
      out.seen = life_->runner.seen();
      out.waiting_for = life_->runner.waiting_for();
    }
  }
  out.clouds_given_up = map_.given_up();
  const std::lock_guard lock(mismatch_mutex_);
  out.legs_mismatch = legs_mismatch_;
  return out;
}

void Node::tick() {
  master_->look();
  states_.publish_path();
  const Condition now = condition();
  DiagnosticsMessage message;
  const std::vector<DiagnosticStatus> all = statuses(now);
  // What changes is reported at once.
  const std::string essence_now = essence(all);
  if (essence_now == last_essence_ && now.now - last_diagnostics_ < diagnostics_period) return;
  if (essence_now != last_essence_) ROS_INFO_STREAM("kilvo: " << all.front().message.c_str());
  last_essence_ = essence_now;
  last_diagnostics_ = now.now;
  message.header.stamp = ros::Time::now();
  message.status.assign(all.begin(), all.end());
  diagnostics_.publish(message);
}

void Node::stop() {
  if (service_spinner_) service_spinner_->stop();
  services_.clear();
  inputs_->stop();
  const std::unique_lock lock(life_mutex_);
  end_life();
}

void Node::offer_services() {
  ros::NodeHandle own("~");
  own.setCallbackQueue(&service_queue_);
  const auto trigger = [&](const std::string& name, bool (Node::*what)(TriggerAnswer&)) {
    const boost::function<bool(Trigger&, TriggerAnswer&)> call = [this, what](Trigger&, TriggerAnswer& answer) {
      return (this->*what)(answer);
    };
    services_.push_back(own.advertiseService<Trigger, TriggerAnswer>(name, call));
  };
  trigger("save_map", &Node::save_map);
  trigger("reset", &Node::reset);
  for (const Sensor sensor : {Sensor::legs, Sensor::lidar, Sensor::camera}) {
    if (!settings_.has(sensor)) continue;
    const boost::function<bool(SetBool&, SetBoolAnswer&)> call = [this, sensor](SetBool& request, SetBoolAnswer& answer) {
      return pause(sensor, request.data != 0, answer);
    };
    services_.push_back(own.advertiseService<SetBool, SetBoolAnswer>(std::string("pause/") + name_of(sensor), call));
  }
  service_spinner_ = std::make_unique<ros::AsyncSpinner>(1, &service_queue_);
  service_spinner_->start();
}

bool Node::save_map(TriggerAnswer& answer) {
  const std::string path = std::filesystem::absolute(parameters_.map_file).string();
  try {
    const std::size_t points = map_.save(path);
    answer.success = 1;
    answer.message = std::string_view(fmt::format("{} points in {}", points, path));
  } catch (const lab::OutputError& error) {
    answer.success = 0;
    answer.message = error.what();
  }
  ROS_INFO_STREAM("kilvo: save_map: " << answer.message.c_str());
  return true;
}

bool Node::reset(TriggerAnswer& answer) {
  const std::unique_lock lock(life_mutex_);  // measurements wait in their queues
  end_life();
  states_.clear();
  map_.clear();
  life_ = begin_life();
  answer.success = 1;
  answer.message = "estimator and map begin anew";
  ROS_INFO_STREAM("kilvo: reset");
  return true;
}

bool Node::pause(Sensor sensor, bool paused, SetBoolAnswer& answer) {
  inputs_->pause(sensor, paused);
  answer.success = 1;
  answer.message = std::string_view(fmt::format("{} {}", name_of(sensor), paused ? "is left out" : "is used again"));
  ROS_INFO_STREAM("kilvo: " << answer.message.c_str());
  return true;
}

}  // namespace kilvo::ros1
