#include "lab/recordings/recording_source.hpp"

#include <algorithm>
#include <cmath>

#include "lab/messages/input_error.hpp"
#include "lab/messages/message_decoder.hpp"
#include "lab/recordings/recording_file.hpp"

namespace kilvo::lab {
namespace {

// Seconds beyond which a time from the command line means "for ever".
constexpr double for_ever = 1e9;

Time after(Time begin, double seconds) { return seconds < for_ever ? begin + from_seconds(std::max(seconds, 0.0)) : Time::max(); }

Time& stamp_in(Measurement& measurement) {
  return std::visit([](auto& m) -> Time& { return m.t; }, measurement);
}

std::string plural(std::uint64_t count, const std::string& what) { return std::to_string(count) + " " + what + (count == 1 ? "" : "s"); }

}  // namespace

std::optional<PointTimeFormat> find_point_time(Rosbag1Reader& reader, const ChosenTopic& lidar, double nominal_rate) {
  reader.select([&](const BagConnection& c) { return c.topic == lidar.topic && c.type == lidar.type; });
  std::vector<CloudTimes> full, small;
  while (full.size() < clouds_to_look_at) {
    const auto message = reader.next();
    if (!message) break;
    auto times = observe_cloud(lidar.type, message->bytes);
    if (!times) continue;
    const bool is_full = times->points > points_of_a_full_cloud;
    if (is_full || (times->points > 1 && small.size() < clouds_to_look_at)) (is_full ? full : small).push_back(*std::move(times));
  }
  const auto& clouds = full.empty() ? small : full;
  if (clouds.empty()) return std::nullopt;
  const Duration period = from_seconds(nominal_rate > 0 ? 1 / nominal_rate : 0.1);
  auto format = detect_point_time_of(lidar.type, clouds, period);
  if (!format) throw InputError(lidar.topic + ": " + format.reason() + "; --no-deskew takes each cloud at its stamp");
  return *std::move(format);
}

RecordingSource::RecordingSource(const std::filesystem::path& input, RecordingOptions options)
    : reader_(open_recording(input)), options_(std::move(options)) {
  for (int i = 0; i < sensor_count; ++i) {
    const auto sensor = static_cast<Sensor>(i);
    if (!options_[sensor].use) continue;
    try {
      chosen_[static_cast<std::size_t>(i)] = choose_topic(reader_.connections(), sensor, options_[sensor].topic);
    } catch (const InputError& error) {
      throw InputError(reader_.name() + ": " + error.what());
    }
  }
  const ChosenTopic& lidar = chosen_[static_cast<std::size_t>(Sensor::lidar)];
  if (!lidar.topic.empty() && !options_.no_deskew) {
    point_time_ = find_point_time(reader_, lidar, options_[Sensor::lidar].rate).value_or(PointTimeFormat{});
  }
  const Time from = after(reader_.begin(), options_.start);
  const auto is_chosen = [&](const BagConnection& c) {
    return std::ranges::any_of(chosen_, [&](const ChosenTopic& chosen) { return c.topic == chosen.topic && c.type == chosen.type; });
  };
  reader_.select(is_chosen, from, from == Time::max() ? from : after(from, options_.duration));
}

std::optional<Measurement> RecordingSource::decode(Sensor sensor, const RawMessage& message) {
  SensorCounts& counts = counts_[static_cast<std::size_t>(sensor)];
  if (message.size > most_message_bytes) {
    ++counts.dropped["too_large"];
    return std::nullopt;
  }
  auto decoded = decode_measurement(message.connection->type, message.bytes, point_time_);
  if (!decoded) {
    auto& first = first_fault_[static_cast<std::size_t>(sensor)];
    if (first.empty()) first = decoded.reason();
    ++counts.dropped["undecodable"];
    return std::nullopt;
  }
  ++counts.used;
  counts.absurd_point_times += decoded->absurd_times;
  Time& stamp = stamp_in(decoded->measurement);
  if (stamp == Time{}) {
    // A driver that does not stamp, as some do not their joints: the time of arrival is the best there is.
    stamp = message.time;
    ++counts.unstamped;
  }
  stamp += from_seconds(options_[sensor].time_offset);
  return std::move(decoded->measurement);
}

std::optional<Measurement> RecordingSource::next() {
  while (const auto message = reader_.next()) {
    const auto sensor = sensor_of_type(message->connection->type);
    auto measurement = decode(sensor.value(), *message);
    recorded_ = message->time;
    if (measurement) return measurement;
  }
  return std::nullopt;
}

std::vector<std::string> RecordingSource::warnings() const {
  std::vector<std::string> texts;
  const auto& damages = reader_.damages();
  if (!damages.empty()) {
    std::string text = reader_.name() + ": damaged at byte " + std::to_string(damages.front().offset) + ": " + damages.front().reason;
    if (damages.size() > 1) text += " (and in " + plural(damages.size() - 1, "more place") + ")";
    texts.push_back(text + "; what could be read is used");
  }
  for (std::size_t i = 0; i < sensor_count; ++i) {
    const std::string& topic = chosen_[i].topic;
    const auto& counts = counts_[i];
    if (topic.empty()) continue;
    if (counts.used == 0 && counts.dropped.empty()) texts.push_back(topic + ": no messages");
    if (counts.dropped.contains("undecodable")) {
      texts.push_back(topic + ": " + plural(counts.dropped.at("undecodable"), "message") + " not decodable; the first: " + first_fault_[i]);
    }
    if (counts.dropped.contains("too_large")) {
      texts.push_back(topic + ": " + plural(counts.dropped.at("too_large"), "message") + " of more than " +
                      std::to_string(most_message_bytes >> 20) + " MB not read");
    }
    if (counts.unstamped > 0) {
      texts.push_back(topic + ": " + plural(counts.unstamped, "message") + " without a stamp: the time of recording is used");
    }
    if (counts.absurd_point_times > 0) {
      texts.push_back(topic + ": " + plural(counts.absurd_point_times, "point") + " dropped, whose time is not within 2 s of the stamp");
    }
  }
  if (!point_time_.usual_span) texts.push_back(topic(Sensor::lidar) + ": point times in " + point_time_.text());
  if (reader_.late_messages() > 0) {
    texts.push_back(plural(reader_.late_messages(), "message") + " came out of order: the chunks of the recording overlap too deeply");
  }
  return texts;
}

}  // namespace kilvo::lab
