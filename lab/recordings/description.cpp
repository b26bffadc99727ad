#include "lab/recordings/description.hpp"

#include <algorithm>
#include <cstdio>

#include "lab/messages/input_error.hpp"
#include "lab/messages/message_decoder.hpp"
#include "lab/recordings/recording_file.hpp"

namespace kilvo::lab {
namespace {

std::string detail_of(const ImuSample& sample) {
  char text[80];
  const double a = sample.accel.norm();
  std::snprintf(text, sizeof text, "first acceleration %.3g, so in %s", a, a < 3 ? "g" : "m/s^2");
  return text;
}

std::string detail_of(const JointSample& sample) {
  if (!sample.names.empty()) {
    std::string text = std::to_string(sample.names.size()) + " names:";
    for (const auto& name : sample.names) text += " " + name;
    return text.size() > 200 ? text.substr(0, 200) + "..." : text;
  }
  const std::string count = std::to_string(sample.position.size());
  return count + " positions without names" + (sample.position.size() == 6 ? ": the two-feet message" : "");
}

std::string detail_of(const LidarScan&) { return {}; }

std::string detail_of(const CameraImage& image) {
  const bool grey = image.image.channels == 1 && image.image.chroma.empty();
  return std::to_string(image.image.width) + "x" + std::to_string(image.image.height) + (grey ? " grey" : " colour");
}

std::string point_time_of(RecordingReader& reader, const TopicDescription& topic) {
  try {
    const auto format = find_point_time(reader, {topic.topic, topic.type}, 0);
    return format ? "point time " + format->text() : "no clouds with points";
  } catch (const InputError& error) {
    return error.what();
  }
}

/// Reads the first message only.
std::string first_of(RecordingReader& reader, const TopicDescription& topic) {
  reader.select([&](const Channel& c) { return c.topic == topic.topic && c.type == topic.type; }, topic.first);
  const auto message = reader.next();
  if (!message) return "not readable";
  std::string details;
  for (const Sensor sensor : topic.fits) {
    const auto decoded = decode_measurement(sensor, topic.type, message->wire(), {});
    const auto detail = decoded ? std::visit([](const auto& m) { return detail_of(m); }, decoded->measurement) : decoded.reason();
    details += (details.empty() ? "" : "; ") + detail;
  }
  return details;
}

void add(TopicDescription& topic, const TimesSummary& times) {
  if (times.count == 0) return;
  topic.first = topic.count == 0 ? times.first : std::min(topic.first, times.first);
  topic.last = topic.count == 0 ? times.last : std::max(topic.last, times.last);
  topic.largest_gap = std::max(topic.largest_gap, to_seconds(times.largest_gap));
  topic.count += times.count;
  const double span = to_seconds(topic.last - topic.first);
  topic.rate = topic.count > 1 && span > 0 ? static_cast<double>(topic.count - 1) / span : 0;
}

/// Topics by name and type: one entry for all the publishers of a topic.
std::vector<TopicDescription> list_topics(const RecordingReader& reader) {
  std::map<std::pair<std::string, std::string>, TopicDescription> topics;
  for (const auto& [id, connection] : reader.connections()) {
    auto& topic = topics[{connection.topic, connection.type}];
    topic.topic = connection.topic;
    topic.type = connection.type;
    topic.encoding = connection.encoding;
    topic.fits = sensors_of_type(connection.type);
    const auto times = reader.times().find(id);
    if (times != reader.times().end()) add(topic, times->second);
  }
  std::vector<TopicDescription> list;
  list.reserve(topics.size());
  for (auto& [name, topic] : topics) list.push_back(std::move(topic));
  return list;
}

void mark_used(RecordingDescription& description, const RecordingReader& reader, const RecordingOptions& options) {
  for (const Sensor sensor : all_sensors) {
    if (options[sensor].topic.empty()) continue;
    try {
      const auto chosen = choose_topic(reader.connections(), sensor, options[sensor].topic);
      for (auto& topic : description.topics) {
        if (topic.topic == chosen.topic && topic.type == chosen.type) topic.used_for.push_back(sensor);
      }
    } catch (const InputError&) {
      // Nothing would be used for this sensor, and the list says so.
    }
  }
}

}  // namespace

RecordingDescription describe_recording(const std::vector<std::filesystem::path>& inputs, const RecordingOptions& options) {
  const auto opened = open_recordings(inputs);
  RecordingReader& reader = *opened;
  RecordingDescription description;
  description.file = reader.name();
  description.bytes = reader.file_size();
  description.begin = reader.begin();
  description.end = reader.end();
  description.storage = reader.storage();
  for (const auto& [id, times] : reader.times()) description.messages += times.count;
  description.topics = list_topics(reader);
  for (auto& topic : description.topics) {
    if (topic.fits.empty() || topic.count == 0) continue;
    topic.detail = topic.fits.front() == Sensor::lidar ? point_time_of(reader, topic) : first_of(reader, topic);
  }
  mark_used(description, reader, options);
  description.damages = reader.damages();
  return description;
}

}  // namespace kilvo::lab
