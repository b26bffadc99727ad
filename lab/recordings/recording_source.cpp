#include "lab/recordings/recording_source.hpp"

#include <algorithm>
#include <cmath>

#include "lab/messages/input_error.hpp"
#include "lab/messages/plural.hpp"
#include "lab/messages/point_time_search.hpp"
#include "lab/recordings/recording_file.hpp"

namespace kilvo::lab {
namespace {

// Seconds beyond which a time from the command line means "for ever".
constexpr double for_ever = 1e9;
// So much is held at most until the sensors' clocks are known.
constexpr std::size_t most_held = 10000;
constexpr Duration longest_held = std::chrono::seconds(5);

SensorClocks clocks_of(const RecordingOptions& options) {
  std::array<double, sensor_count> offsets{};
  for (const Sensor sensor : all_sensors) offsets[index_of(sensor)] = options[sensor].time_offset;
  SensorClocks clocks(offsets);
  if (!options[Sensor::imu].use) clocks.give_up();
  return clocks;
}

Time after(Time begin, double seconds) { return seconds < for_ever ? begin + from_seconds(std::max(seconds, 0.0)) : Time::max(); }

}  // namespace

std::optional<PointTimeFormat> find_point_time(RecordingReader& reader, const ChosenTopic& lidar, double nominal_rate) {
  reader.select([&](const Channel& c) { return c.topic == lidar.topic && c.type == lidar.type; });
  PointTimeSearch search(lidar.type, nominal_rate);
  while (!search.has_enough()) {
    const auto message = reader.next();
    if (!message) break;
    search.look_at(message->wire());
  }
  if (!search.has_any()) return std::nullopt;
  auto format = search.decide();
  if (!format) throw InputError(lidar.topic + ": " + format.reason() + "; --no-deskew takes each cloud at its stamp");
  return *std::move(format);
}

RecordingSource::RecordingSource(const std::vector<std::filesystem::path>& inputs, RecordingOptions options)
    : reader_(open_recordings(inputs)), options_(std::move(options)), clocks_(clocks_of(options_)) {
  for (const Sensor sensor : all_sensors) {
    if (!options_[sensor].use) continue;
    const SensorInput& wanted = options_[sensor];
    intakes_[index_of(sensor)] =
        SensorIntake(wanted.time_offset, wanted.gyro_scale, options_.with_colours, wanted.joints, wanted.with_velocities);
    try {
      chosen_[index_of(sensor)] = choose_topic(reader_->connections(), sensor, options_[sensor].topic);
    } catch (const InputError& error) {
      throw InputError(reader_->name() + ": " + error.what());
    }
  }
  if (const double lasts = to_seconds(duration()); options_.start > lasts)
    throw InputError(reader_->name() + ": ends after " + std::to_string(lasts) + " s, before --start " + std::to_string(options_.start));
  const ChosenTopic& lidar = chosen_[static_cast<std::size_t>(Sensor::lidar)];
  if (!lidar.topic.empty() && !options_.no_deskew) {
    point_time_ = find_point_time(*reader_, lidar, options_[Sensor::lidar].rate).value_or(PointTimeFormat{});
  }
  const Time from = after(reader_->begin(), options_.start);
  const auto is_chosen = [&](const Channel& c) {
    return std::ranges::any_of(chosen_, [&](const ChosenTopic& chosen) { return c.topic == chosen.topic && c.type == chosen.type; });
  };
  reader_->select(is_chosen, from, from == Time::max() ? from : after(from, options_.duration));
}

std::optional<Measurement> RecordingSource::decode(Sensor sensor, const RawMessage& message) {
  SensorIntake& intake = intakes_[static_cast<std::size_t>(sensor)];
  if (message.size > most_message_bytes) {
    intake.refuse_too_large();
    return std::nullopt;
  }
  auto measurement = intake.take(sensor, message.connection->type, message.wire(), message.time, point_time_);
  if (!measurement || !options_.leg_clock) return measurement;
  const char* why = options_.leg_clock->follow(*measurement, message.time, {intake.tick(), intake.gyro()});
  if (why == nullptr) return measurement;
  intake.take_back(why);
  return std::nullopt;
}

std::optional<Measurement> RecordingSource::next() {
  while (held_.empty() || !clocks_.knows_all()) {
    auto measurement = read();
    if (!measurement) {
      clocks_.give_up();
      break;
    }
    clocks_.note(*measurement, message_->time);
    held_.push_back({*std::move(measurement), message_->time});
    if (held_.size() == most_held || message_->time - held_.front().recorded > longest_held) clocks_.wait_no_longer();
  }
  if (held_.empty()) return std::nullopt;
  Measurement out = std::move(held_.front().measurement);
  recorded_ = held_.front().recorded;
  held_.pop_front();
  clocks_.correct(out, recorded_);
  return out;
}

/// A message may be of several sensors: a LowState is of the IMU and of the legs.
std::optional<Measurement> RecordingSource::read() {
  while (true) {
    for (; message_ && next_sensor_ < sensor_count; ++next_sensor_) {
      const ChosenTopic& chosen = chosen_[next_sensor_];
      if (message_->connection->topic != chosen.topic || message_->connection->type != chosen.type) continue;
      if (auto measurement = decode(static_cast<Sensor>(next_sensor_), *message_)) {
        ++next_sensor_;
        return measurement;
      }
    }
    message_ = reader_->next();
    if (!message_) return std::nullopt;
    next_sensor_ = 0;
  }
}

std::vector<std::string> RecordingSource::warnings() const {
  std::vector<std::string> texts;
  const auto& damages = reader_->damages();
  if (!damages.empty()) {
    const std::string& file = damages.front().file.empty() ? reader_->name() : damages.front().file;
    std::string text = file + ": damaged at byte " + std::to_string(damages.front().offset) + ": " + damages.front().reason;
    if (damages.size() > 1) text += " (and in " + plural(damages.size() - 1, "more place") + ")";
    texts.push_back(text + "; what could be read is used");
  }
  for (std::size_t i = 0; i < sensor_count; ++i) {
    const std::string& topic = chosen_[i].topic;
    const auto& counts = intakes_[i].counts();
    if (topic.empty()) continue;
    if (counts.used == 0 && counts.dropped.empty()) texts.push_back(topic + ": no messages");
    if (counts.dropped.contains("undecodable")) {
      texts.push_back(topic + ": " + plural(counts.dropped.at("undecodable"), "message") +
                      " not decodable; the first: " + intakes_[i].first_fault());
    }
    if (counts.dropped.contains("too_large")) {
      texts.push_back(topic + ": " + plural(counts.dropped.at("too_large"), "message") + " of more than " +
                      std::to_string(most_message_bytes >> 20) + " MB not read");
    }
    if (counts.unstamped > 0) {
      texts.push_back(topic + ": " + plural(counts.unstamped, "message") + " without a stamp: the time of recording is used");
    }
    // One that was lost, or comes at another moment, is none that lacks.
    if (counts.unused_parts > counts.used / 20) {
      texts.push_back(topic + ": " + plural(counts.unused_parts, "message") +
                      " with a part of the joints not used: the others did not come in time");
    }
    for (const std::string& text : intakes_[i].findings()) texts.push_back(topic + ": " + text);
  }
  for (const Sensor sensor : all_sensors) {
    for (const std::string& text : {clocks_.finding(sensor), clocks_.drift_finding(sensor), clocks_.step_finding(sensor)}) {
      if (!text.empty()) texts.push_back(text);
    }
  }
  if (options_.leg_clock) {
    const auto& clock = *options_.leg_clock;
    const auto text = clock.offset() ? std::to_string(1e3 * *clock.offset()) + " ms to the times of arrival" : std::string("not found");
    texts.push_back("legs: clock by comparison with the IMU: " + text + "; " + plural(clock.withheld(), "sample") +
                    " before that not used");
  }
  if (!point_time_.usual_span) texts.push_back(topic(Sensor::lidar) + ": point times in " + point_time_.text());
  if (reader_->late_messages() > 0) {
    texts.push_back(plural(reader_->late_messages(), "message") + " came out of order: the chunks of the recording overlap too deeply");
  }
  return texts;
}

}  // namespace kilvo::lab
