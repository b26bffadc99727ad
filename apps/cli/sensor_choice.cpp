#include "apps/cli/sensor_choice.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/core.h>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string_view>

#include "apps/cli/exit_code.hpp"
#include "lab/messages/input_error.hpp"
#include "lab/messages/message_decoder.hpp"
#include "lab/recordings/recording_file.hpp"
#include "lab/settings/nearest.hpp"

namespace kilvo::cli {
namespace {

Sensor parse_sensor(const std::string& name) {
  std::vector<std::string> names;
  for (const Sensor sensor : all_sensors) {
    names.emplace_back(name_of(sensor));
    if (name == names.back()) return sensor;
  }
  throw UsageError(fmt::format("no sensor '{}', nearest is '{}' (sensors: imu, legs, lidar, camera)", name, lab::nearest(name, names)));
}

// Takes a number of seconds from the beginning of `text`.
std::optional<double> take_seconds(std::string_view& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value) || value < 0) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

std::vector<Sensor> as_wanted(const std::vector<Sensor>& wanted, const lab::Settings& settings, const std::string& config) {
  if (std::ranges::find(wanted, Sensor::imu) == wanted.end())
    throw UsageError("--sensors: the imu is needed, nothing is estimated without it");
  const auto wants = [&wanted](Sensor sensor) { return std::ranges::find(wanted, sensor) != wanted.end(); };
  if (wants(Sensor::camera) && !wants(Sensor::lidar))
    throw UsageError("--sensors: the camera needs the lidar, whose surfaces its patches lie on");
  for (const Sensor sensor : wanted) {
    if (!settings.has(sensor))
      throw UsageError(fmt::format("{}: {}.topic is missing: the sensor '{}' is not configured", config, name_of(sensor), name_of(sensor)));
  }
  return wanted;
}

std::set<std::string> topics_of(const lab::RecordingReader& recording) {
  std::set<std::string> out;
  for (const auto& [id, connection] : recording.connections()) out.insert(connection.topic);
  return out;
}

// A topic of the sensor's kind that no setting names: then the setting is misspelt, and the sensor is not simply absent.
std::optional<std::string> unnamed_topic(Sensor sensor, const lab::Settings& settings, const lab::RecordingReader& recording) {
  for (const auto& entry : recording.connections()) {
    const lab::Channel& connection = entry.second;
    if (!lab::is_type_of(sensor, connection.type)) continue;
    const bool named = std::ranges::any_of(all_sensors, [&](Sensor other) {
      return settings.has(other) && lab::topic_matches(other, settings.topic(other), connection.topic);
    });
    if (!named) return connection.topic;
  }
  return std::nullopt;
}

std::string names_of(const std::vector<Sensor>& sensors) {
  std::string out;
  for (const Sensor sensor : sensors) {
    if (!out.empty()) out += ',';
    out += name_of(sensor);
  }
  return out;
}

std::string first_few(const std::set<std::string>& names) {
  constexpr std::size_t most = 12;
  std::string out;
  std::size_t count = 0;
  for (const std::string& name : names) {
    if (count++ == most) return out + ", ...";
    out += (out.empty() ? "" : ", ") + name;
  }
  return out;
}

// `failure` from T0 to T1 as "T0-T1", or "T0-" to the end.
lab::Failure between_times(lab::Failure failure, std::string_view rest, const UsageError& wrong) {
  const auto from = take_seconds(rest);
  if (!from || !rest.starts_with('-')) throw wrong;
  failure.from = *from;
  rest.remove_prefix(1);
  if (rest.empty()) return failure;
  const auto until = take_seconds(rest);
  if (!until || !rest.empty() || *until < *from) throw wrong;
  failure.until = *until;
  return failure;
}

}  // namespace

std::vector<Sensor> parse_sensors(const std::string& list) {
  std::set<Sensor> out;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    out.insert(parse_sensor(list.substr(begin, end - begin)));
    begin = end + 1;
  }
  return {out.begin(), out.end()};
}

lab::Failure parse_delay(const std::string& text) {
  const UsageError wrong(fmt::format("--delay {}: must be SENSOR:MS in milliseconds, as in camera:50", text));
  const auto colon = text.find(':');
  if (colon == std::string::npos) throw wrong;
  std::string_view rest = std::string_view(text).substr(colon + 1);
  const auto milliseconds = take_seconds(rest);
  constexpr double most = 60000;
  if (!milliseconds || !rest.empty() || *milliseconds > most) throw wrong;
  return {.kind = lab::FailureKind::delay,
          .sensor = parse_sensor(text.substr(0, colon)),
          .amount = 1e-3 * *milliseconds,
          .as_asked = fmt::format("--delay {}", text)};
}

lab::Failure parse_drop(const std::string& text) {
  const UsageError wrong(fmt::format("--drop {}: must be SENSOR:T0-T1 in seconds, as in lidar:10-16, or lidar:10- (to the end)", text));
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) throw wrong;
  return between_times({.sensor = parse_sensor(text.substr(0, colon)), .as_asked = fmt::format("--drop {}", text)}, text.substr(colon + 1),
                       wrong);
}

lab::Failure parse_degradation(const std::string& text) {
  const UsageError wrong(
      fmt::format("--degrade {}: must be KIND:T0-T1, KIND one of dark, blank, narrow, accel, gyro, as in dark:10-16", text));
  // A thirtieth of the light; a sector of 30 degrees.
  std::map<std::string, lab::Failure> kinds{
      {"dark", {.kind = lab::FailureKind::darkness, .sensor = Sensor::camera, .amount = 1.0 / 30}},
      {"blank", {.kind = lab::FailureKind::textureless, .sensor = Sensor::camera}},
      {"narrow", {.kind = lab::FailureKind::narrow_sector, .sensor = Sensor::lidar, .amount = std::numbers::pi / 6}},
      {"accel", {.kind = lab::FailureKind::freeze_half, .sensor = Sensor::imu}},
      {"gyro", {.kind = lab::FailureKind::freeze_half, .sensor = Sensor::imu, .amount = 1}}};
  const std::size_t colon = text.find(':');
  const auto kind = kinds.find(text.substr(0, colon));
  if (colon == std::string::npos || kind == kinds.end()) throw wrong;
  kind->second.as_asked = fmt::format("--degrade {}", text);
  return between_times(kind->second, text.substr(colon + 1), wrong);
}
void warn_of_no_effect(const lab::FailingSource& failing, const std::vector<Sensor>& used, std::vector<std::string>& out) {
  for (const lab::Failure* asked : failing.without_effect()) {
    const bool is_used = std::ranges::find(used, asked->sensor) != used.end();
    const char* name = name_of(asked->sensor);
    out.push_back(
        fmt::format("{}: without effect, {}", asked->as_asked,
                    is_used ? fmt::format("no message of the {} came in that time", name) : fmt::format("the {} is not used", name)));
  }
}

std::string joined(const std::vector<std::string>& inputs) {
  std::string all;
  for (const std::string& input : inputs) all += (all.empty() ? "" : " + ") + input;
  return all;
}

SensorChoice choose_sensors(const std::optional<std::vector<Sensor>>& wanted, const lab::Settings& settings, const std::string& config,
                            const std::vector<std::string>& inputs) {
  SensorChoice out;
  if (wanted) {
    out.used = as_wanted(*wanted, settings, config);
    return out;
  }
  const std::string input = joined(inputs);
  const auto recording = lab::open_recordings({inputs.begin(), inputs.end()});
  const std::set<std::string> topics = topics_of(*recording);
  if (topics.empty()) throw lab::InputError(fmt::format("{}: holds no messages", input));
  // Images alone measure no motion: without these the estimator coasts.
  const auto measures_motion = [](Sensor sensor) { return sensor == Sensor::legs || sensor == Sensor::lidar; };
  bool any_present = false, more_configured = false;
  std::vector<std::string> missing;
  std::vector<Sensor> absent;
  for (const Sensor sensor : all_sensors) {
    if (!settings.has(sensor)) continue;
    const std::string& pattern = settings.topic(sensor);
    const bool present = std::ranges::any_of(topics, [&](const std::string& topic) { return lab::topic_matches(sensor, pattern, topic); });
    any_present = any_present || present;
    more_configured = more_configured || measures_motion(sensor);
    if (present) {
      out.used.push_back(sensor);
    } else {
      const std::vector<std::string> names(topics.begin(), topics.end());
      missing.push_back(fmt::format("no topic {} ({}), nearest is {}", pattern, name_of(sensor), lab::nearest(pattern, names)));
      out.warnings.push_back(missing.back());
      absent.push_back(sensor);
    }
  }
  if (!any_present) {
    throw lab::InputError(
        fmt::format("{}: none of the topics in {} is in it; it has {}; choose another --config", input, config, first_few(topics)));
  }
  if (out.used.empty() || out.used.front() != Sensor::imu) {
    throw lab::InputError(fmt::format("{}: {}", input, missing.empty() ? "no IMU is configured" : missing.front()));
  }
  for (std::size_t i = 0; i < absent.size(); ++i) {
    if (const auto topic = unnamed_topic(absent[i], settings, *recording)) {
      throw lab::InputError(fmt::format("{}: {}; {} is of that kind: --set {}.topic={}, or leave the sensor out with --sensors {}", input,
                                        missing[i], *topic, name_of(absent[i]), *topic, names_of(out.used)));
    }
  }
  if (more_configured && std::ranges::none_of(out.used, measures_motion)) {
    std::string why;
    for (const std::string& text : out.warnings) why += text + "; ";
    throw lab::InputError(
        fmt::format("{}: neither legs nor LiDAR could be used: {}say --sensors imu if that is what you want", input, why));
  }
  return out;
}

}  // namespace kilvo::cli
