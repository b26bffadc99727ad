#include "lab/recordings/topic_choice.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "lab/messages/input_error.hpp"
#include "lab/messages/message_decoder.hpp"

namespace kilvo::lab {
namespace {

std::string accepted_text(Sensor sensor) {
  std::string text;
  for (const auto type : accepted_types(sensor)) text.append(text.empty() ? "" : " or ").append(type);
  return text;
}

bool right_type(Sensor sensor, const Channel& connection) {
  return connection.encoding != Encoding::other && is_type_of(sensor, connection.type);
}

/// Topics of the right type first, then by spelling.
const Channel* nearest(const std::map<std::uint32_t, Channel>& connections, Sensor sensor, const std::string& pattern) {
  const Channel* best = nullptr;
  std::pair<bool, std::size_t> best_rank;
  for (const auto& [id, connection] : connections) {
    const std::pair rank{!right_type(sensor, connection), edit_distance(pattern, connection.topic)};
    if (best == nullptr || rank < best_rank) {
      best = &connection;
      best_rank = rank;
    }
  }
  return best;
}

[[noreturn]] void refuse_missing(const std::map<std::uint32_t, Channel>& connections, Sensor sensor, const std::string& pattern) {
  std::string text = "no topic " + pattern + " for the sensor " + name_of(sensor);
  const Channel* other = nearest(connections, sensor, pattern);
  if (other == nullptr) throw InputError(text + ": the recording has no topics");
  text += "; the nearest is " + other->topic + " (" + other->type + ")";
  if (!right_type(sensor, *other)) text += ", but none is of type " + accepted_text(sensor);
  throw InputError(text);
}

}  // namespace

bool topic_matches(Sensor sensor, const std::string& pattern, const std::string& topic) {
  const std::string_view wanted = without_slash(pattern), name = without_slash(topic);
  if (name == wanted) return true;
  constexpr std::string_view suffix = "/compressed";
  return sensor == Sensor::camera && name.ends_with(suffix) && name.substr(0, name.size() - suffix.size()) == wanted;
}

ChosenTopic choose_topic(const std::map<std::uint32_t, Channel>& connections, Sensor sensor, const std::string& pattern) {
  const Channel* chosen = nullptr;
  const Channel* wrong = nullptr;
  for (const auto& [id, connection] : connections) {
    if (!topic_matches(sensor, pattern, connection.topic)) continue;
    if (!right_type(sensor, connection)) {
      wrong = &connection;
    } else if (chosen == nullptr || connection.topic.size() < chosen->topic.size()) {
      chosen = &connection;
    }
  }
  if (chosen != nullptr) return {chosen->topic, chosen->type};
  if (wrong == nullptr) refuse_missing(connections, sensor, pattern);
  throw InputError("topic " + wrong->topic + " is of type " + wrong->type + ", but the sensor " + name_of(sensor) + " needs " +
                   accepted_text(sensor));
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, diagonal + 1, row[j] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace kilvo::lab
