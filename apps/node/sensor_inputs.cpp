#include "apps/node/sensor_inputs.hpp"

#include <fmt/core.h>
#include <utility>

#include "lab/messages/message_decoder.hpp"
#include "lab/settings/leg_joints.hpp"

namespace kilvo::node {
namespace {

constexpr std::size_t most_clouds = 20;  // that wait until it is known how their points' times are written
constexpr std::size_t most_kinds = 100;  // of faults that are told
// Images that come compressed are left out while the same come uncompressed.
constexpr auto raw_is_near = std::chrono::seconds(1);

std::string accepted_text(Sensor sensor) {
  std::string text;
  for (const auto type : lab::accepted_types(sensor)) text += fmt::format("{}{}", text.empty() ? "" : " or ", type);
  return text;
}

}  // namespace

SensorInputs::SensorInputs(const lab::Settings& settings, bool no_deskew, Sink sink, Say say)
    : sink_(std::move(sink)),
      say_(std::move(say)),
      lidar_rate_(settings.robot.lidar.rate),
      leg_clock_(settings.leg_clock, settings.robot),
      clocks_(time_offsets_of(settings.robot)) {
  if (no_deskew || !settings.clouds.deskew) point_time_.emplace();
  for (const Sensor sensor : all_sensors) {
    input_of(sensor).topic = settings.topic(sensor);
    input_of(sensor).intake = lab::SensorIntake(time_offsets_of(settings.robot)[index_of(sensor)], settings.robot.imu.gyro_scale, true,
                                                sensor == Sensor::legs ? lab::leg_joints(settings.robot) : JointNames(),
                                                settings.robot.legs.velocities == "messages");
  }
}

// False: the same image comes uncompressed as well.
bool SensorInputs::note_arrival(Input& input, bool is_compressed) {
  const std::lock_guard lock(input.mutex);
  const auto now = SteadyClock::now();
  if (is_compressed && input.raw_last && now - *input.raw_last < raw_is_near) return false;
  if (!is_compressed) input.raw_last = now;
  ++input.messages;
  input.last = now;
  return true;
}

void SensorInputs::receive(Sensor sensor, const Arrived& arrived, bool is_compressed) {
  Input& input = input_of(sensor);
  if (!note_arrival(input, is_compressed)) return;
  if (!lab::is_type_of(sensor, arrived.type)) {
    complain(input, fmt::format("its type is {}, but the sensor {} needs {}", arrived.type, name_of(sensor), accepted_text(sensor)));
    return;
  }
  if (input.paused) return;
  if (sensor == Sensor::lidar && !point_time_) {
    search_point_time(arrived);
  } else {
    take(sensor, arrived);
  }
}

void SensorInputs::take(Sensor sensor, const Arrived& arrived) {
  Input& input = input_of(sensor);
  // Only the LiDAR's thread may look at what it has found out.
  const lab::PointTimeFormat point_time = sensor == Sensor::lidar && point_time_ ? *point_time_ : lab::PointTimeFormat{};
  std::optional<Measurement> measurement;
  {
    const std::lock_guard lock(input.mutex);
    measurement = input.intake.take(sensor, arrived.type, arrived.message, arrived.at, point_time);
    if (input.intake.newest_fault().empty()) input.fault.clear();
    if (measurement && is_quick(sensor) && !give_time(input, *measurement, arrived.at)) return;
  }
  if (const int found = input.intake.finding_count(); found > input.findings) {
    input.findings = found;
    for (const std::string& text : input.intake.findings()) tell_once(input, text);
  }
  if (measurement && !bring_onto_imu_clock(input, *measurement, arrived.at)) return;
  if (measurement) {
    sink_(*std::move(measurement), arrived.at);
  } else if (!input.intake.newest_fault().empty()) {
    complain(input, input.intake.newest_fault());
  }
}

// False: it is not to be used.
bool SensorInputs::give_time(Input& input, Measurement& measurement, Time arrived) {
  if (!leg_clock_.is_needed()) return true;
  const char* why = leg_clock_.follow(measurement, arrived, {input.intake.tick(), input.intake.gyro()});
  input.clock = leg_clock_.offset();
  if (why != nullptr) input.intake.take_back(why);
  return why == nullptr;
}

// False: it is not to be used, since the sensor's clock is not known yet.
bool SensorInputs::bring_onto_imu_clock(Input& input, Measurement& measurement, Time arrived) {
  const Sensor sensor = sensor_of(measurement);
  std::optional<Duration> by;
  std::string finding, drift, step;
  bool known = false;
  {
    const std::lock_guard lock(clocks_mutex_);
    clocks_.note(measurement, arrived);
    known = clocks_.knows(sensor);
    if (known) clocks_.correct(measurement, arrived);
    by = clocks_.offset(sensor);
    if (by && !input.moved) finding = clocks_.finding(sensor);
    if (!input.drifts) drift = clocks_.drift_finding(sensor);
    if (const int steps = clocks_.steps(sensor); std::exchange(input.clock_steps, steps) != steps) step = clocks_.step_finding(sensor);
  }
  {
    const std::lock_guard lock(input.mutex);
    if (!known) input.intake.take_back("clock not known yet");
    if (by) input.moved = to_seconds(*by);
  }
  if (!finding.empty()) say_(finding);
  if (!step.empty()) say_(step);
  if (!drift.empty()) {
    input.drifts = true;
    say_(drift);
  }
  return known;
}

// The first clouds wait until they have shown how their points' times are written.
void SensorInputs::search_point_time(const Arrived& arrived) {
  if (!search_ || held_.empty() || held_.back().type != arrived.type) {
    search_.emplace(std::string(arrived.type), lidar_rate_);
    held_.clear();
  }
  const lab::WireMessage& message = arrived.message;
  search_->look_at(message);
  held_.push_back({std::string(arrived.type), {message.bytes.begin(), message.bytes.end()}, message.encoding, arrived.at});
  if (!search_->has_enough() && !search_->has_only_small()) {
    if (held_.size() > most_clouds) held_.erase(held_.begin());
    return;
  }
  const auto found = search_->decide();
  const std::vector<Held> clouds = std::exchange(held_, {});
  search_.reset();
  Input& input = input_of(Sensor::lidar);
  if (!found) {
    complain(input, fmt::format("{}; no_deskew takes each cloud at its stamp", found.reason()));
    return;
  }
  point_time_ = *found;
  say_("lidar from " + input.topic + ", point time: " + point_time_->text());
  for (const Held& cloud : clouds) take(Sensor::lidar, {cloud.type, {cloud.bytes, cloud.encoding}, cloud.at});
}

void SensorInputs::complain(Input& input, const std::string& fault) {
  {
    const std::lock_guard lock(input.mutex);
    input.fault = fault;
  }
  tell_once(input, fault);
}

// Each kind is reported once: garbage has another fault in every message, and so many numbers in them.
void SensorInputs::tell_once(Input& input, const std::string& text) {
  std::string kind = text;
  std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
  {
    const std::lock_guard lock(input.mutex);
    if (input.said.size() >= most_kinds || !input.said.insert(kind).second) return;
  }
  say_(input.topic + ": " + text);
}

void SensorInputs::note_connection(Sensor sensor, const std::string& fault) {
  Input& input = input_of(sensor);
  {
    const std::lock_guard lock(input.mutex);
    if (std::exchange(input.connection, fault) == fault || fault.empty()) return;
  }
  say_(input.topic + ": " + fault);
}

InputState SensorInputs::state(Sensor sensor) const {
  const Input& input = inputs_[static_cast<std::size_t>(sensor)];
  const std::lock_guard lock(input.mutex);
  return {input.topic,  input.messages, input.last, input.intake.counts(), input.fault, input.connection,
          input.paused, input.clock,    input.moved};
}

}  // namespace kilvo::node
