#include "apps/node/diagnostics.hpp"

#include <algorithm>
#include <fmt/core.h>

namespace kilvo::node {
namespace {

// By the clock on the wall: three messages in a row, but no less than a machine may be busy.
constexpr double least_silence = 0.2, periods_of_silence = 3;  // s, -

void add(DiagnosticStatus& status, const std::string& key, const std::string& value) { status.values.push_back({key, value}); }

DiagnosticStatus named(const std::string& name) { return {DiagnosticStatus::ok, "kilvo: " + name, "", "kilvo", {}}; }

void say(DiagnosticStatus& status, std::uint8_t level, const std::string& text) {
  status.level = level;
  status.message = text;
}

/// The level and the reason; nothing when the sensor is well.
struct Trouble {
  std::uint8_t level;
  std::string text;
};

std::optional<Trouble> trouble_of(Sensor sensor, const Condition& c) {
  const auto s = static_cast<std::size_t>(sensor);
  const InputState& input = c.inputs[s];
  if (input.paused) return Trouble{DiagnosticStatus::warn, fmt::format("lost: paused by the service pause/{}", name_of(sensor))};
  if (!input.connection.empty() && (!input.last || silence_of(input, c.rates[s], c.now)))
    return Trouble{DiagnosticStatus::error, fmt::format("lost: {}: {}", input.topic, input.connection)};
  if (!input.last) return Trouble{DiagnosticStatus::error, "lost: no message on " + input.topic + " yet"};
  if (const auto silent = silence_of(input, c.rates[s], c.now))
    return Trouble{DiagnosticStatus::error, fmt::format("lost: no message on {} for {:.1f} s", input.topic, *silent)};
  if (sensor == Sensor::legs && !c.legs_mismatch.empty()) return Trouble{DiagnosticStatus::error, "lost: " + c.legs_mismatch};
  if (!input.fault.empty()) return Trouble{DiagnosticStatus::error, fmt::format("lost: {}: {}", input.topic, input.fault)};
  return std::nullopt;
}

std::string text_of(const lab::WrongDescription& wrong) { return fmt::format("{}; {}", wrong.finding.text, wrong.finding.remedy); }

// A sensor that is there, and is not as described.
std::optional<Trouble> doubt_of(Sensor sensor, const Condition& c) {
  std::optional<Trouble> out;
  for (const lab::WrongDescription& wrong : c.wrong) {
    if (wrong.finding.sensor != sensor || (out && !wrong.spoils)) continue;
    out = {wrong.spoils ? DiagnosticStatus::error : DiagnosticStatus::warn, "not as described: " + text_of(wrong)};
    if (wrong.spoils) break;
  }
  return out;
}

DiagnosticStatus status_of(Sensor sensor, const Condition& c) {
  const auto s = static_cast<std::size_t>(sensor);
  const InputState& input = c.inputs[s];
  DiagnosticStatus out = named(name_of(sensor));
  const Trouble trouble = trouble_of(sensor, c).value_or(doubt_of(sensor, c).value_or(Trouble{DiagnosticStatus::ok, "ok"}));
  say(out, trouble.level, trouble.text);
  add(out, "topic", input.topic);
  add(out, "messages", std::to_string(input.messages));
  if (!input.connection.empty()) add(out, "connection", input.connection);
  for (const auto& [cause, count] : input.counts.dropped) add(out, "dropped: " + cause, std::to_string(count));
  if (sensor == Sensor::legs && input.clock) add(out, "clock found (s)", fmt::format("{:+.4f}", *input.clock));
  if (input.moved) add(out, "stamps of another clock, moved by (s)", fmt::format("{:+.6f}", *input.moved));
  if (input.counts.unused_parts > 0) add(out, "parts of the joints not used", std::to_string(input.counts.unused_parts));
  if (input.counts.unstamped > 0) add(out, "without a stamp", std::to_string(input.counts.unstamped));
  const SensorCount& seen = c.seen.sensors[s];
  add(out, "used", std::to_string(seen.used));
  for (const auto& [cause, count] : seen.dropped) add(out, "dropped: " + cause, std::to_string(count));
  const StreamHealth& health = c.seen.health[s];
  add(out, "mean interval (s)", fmt::format("{:.5f}", health.mean_interval));
  add(out, "jitter (s)", fmt::format("{:.5f}", health.jitter));
  add(out, "longest gap (s)", fmt::format("{:.3f}", health.longest_gap));
  if (health.frozen > 0) add(out, "times frozen", std::to_string(health.frozen));
  if (health.clipped > 0) add(out, "clipped samples", std::to_string(health.clipped));
  if (health.off_clock > 0) add(out, "stamped ahead of the IMU", std::to_string(health.off_clock));
  return out;
}

// A warning stands for so long after it was true last; an event that goes on is told again. It stays in the values.
constexpr Duration standing = std::chrono::seconds(60);

/// The newest of the worst events that still stand, above notices.
const Event* standing_warning(const EstimateState& e) {
  const Event* out = nullptr;
  for (const Event& event : e.events) {
    const Severity severity = row_of(event.reason).severity;
    if (severity == Severity::notice || e.t - event.t > standing) continue;
    if (out == nullptr || severity >= row_of(out->reason).severity) out = &event;
  }
  return out;
}

void add_events(DiagnosticStatus& status, const EstimateState& e) {
  for (const Event& event : e.events) {
    add(status, name_of(row_of(event.reason).severity),
        fmt::format("{}: {:.3f} s, {} times, {}", name_of(event.reason), to_seconds(event.t.time_since_epoch()), event.count,
                    text_of(event)));
  }
}

/// The sensors of which nothing comes; a topic on which nothing ever came may be misspelt.
std::string lost_sensors(const Condition& c) {
  std::string lost;
  for (std::size_t i = 0; i < sensor_count; ++i) {
    const auto sensor = static_cast<Sensor>(i);
    const InputState& input = c.inputs[i];
    if (input.topic.empty() || !trouble_of(sensor, c)) continue;
    lost += (lost.empty() ? "" : ", ") + std::string(name_of(sensor));
    if (!input.last) lost += fmt::format(" (no message on {} yet)", input.topic);
  }
  return lost;
}

DiagnosticStatus status_of_estimate(const Condition& c) {
  DiagnosticStatus out = named("estimator");
  const std::string lost = lost_sensors(c);
  if (!c.estimate) {
    const std::string text = c.waiting_for.empty() ? "waiting for the first output" : c.waiting_for;
    say(out, DiagnosticStatus::warn, lost.empty() ? text : fmt::format("{}, lost: {}", text, lost));
    for (const std::string& warning : warnings_of(c.seen)) add(out, "warning", warning);
    return out;
  }
  const EstimateState& e = *c.estimate;
  std::uint8_t level = lost.empty() ? DiagnosticStatus::ok : DiagnosticStatus::warn;
  if (!c.base_waits_for.empty()) level = DiagnosticStatus::warn;
  if (e.modality == Modality::coast || c.seen.diverged || trouble_of(Sensor::imu, c)) level = DiagnosticStatus::error;
  std::string text = fmt::format("{} ({})", name_of(e.modality), text_of(e.cause));
  if (!lost.empty()) text += ", lost: " + lost;
  if (!c.base_waits_for.empty()) text += ", " + c.base_waits_for;
  if (e.epoch > 0) text += fmt::format(", epoch {}", e.epoch + 1);
  if (c.seen.diverged) text += ", diverged";
  if (const Event* event = standing_warning(e)) {
    const bool is_error = row_of(event->reason).severity == Severity::error;
    level = std::max<std::uint8_t>(level, is_error ? DiagnosticStatus::error : DiagnosticStatus::warn);
    text += ", " + text_of(*event);
  }
  for (const lab::WrongDescription& wrong : c.wrong) {
    if (!wrong.spoils) continue;
    level = DiagnosticStatus::error;
    text += ", the description of the robot is wrong: " + wrong.finding.text;
  }
  say(out, level, text);
  add(out, "modality", name_of(e.modality));
  add(out, "cause", text_of(e.cause));
  add(out, "lost", lost.empty() ? "none" : lost);
  add(out, "epoch", std::to_string(e.epoch + 1));
  add(out, "outputs", std::to_string(e.outputs));
  add(out, "position, one sigma (m)", fmt::format("{:.4f}", std::sqrt(std::max(0.0, e.position_covariance.trace()))));
  add(out, "IMU outages", std::to_string(c.seen.imu_outages));
  add(out, "states thrown away", std::to_string(c.seen.rollbacks));
  add(out, "sweeps not mapped in time", std::to_string(c.clouds_given_up));
  add_events(out, e);
  for (const lab::WrongDescription& wrong : c.wrong) add(out, "description", text_of(wrong));
  return out;
}

}  // namespace

std::optional<double> silence_of(const InputState& input, double rate, SteadyClock::time_point now) {
  if (!input.last) return std::nullopt;
  const double silent = std::chrono::duration<double>(now - *input.last).count();
  const double limit = std::max(least_silence, rate > 0 ? periods_of_silence / rate : 0);
  return silent > limit ? std::optional(silent) : std::nullopt;
}

std::vector<DiagnosticStatus> statuses(const Condition& condition) {
  std::vector<DiagnosticStatus> out = {status_of_estimate(condition)};
  for (const Sensor sensor : all_sensors) {
    if (!condition.inputs[index_of(sensor)].topic.empty()) out.push_back(status_of(sensor, condition));
  }
  return out;
}

std::string essence(const std::vector<DiagnosticStatus>& statuses) {
  std::string out;
  for (const DiagnosticStatus& status : statuses) out += std::to_string(status.level);
  return out + statuses.front().message;
}

}  // namespace kilvo::node
