// Which topic of a recording is the one that the configuration means?
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "kilvo/sensors/measurement.hpp"
#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

inline std::string_view without_slash(std::string_view topic) { return topic.starts_with('/') ? topic.substr(1) : topic; }

/// True when `pattern` from the configuration means `topic`: the same name (with or without the leading slash) or, for a camera, the
/// same name with `/compressed` behind it.
bool topic_matches(Sensor sensor, const std::string& pattern, const std::string& topic);

struct ChosenTopic {
  std::string topic;
  std::string type;
};

/// The topic to read for a sensor; the raw images where there are compressed ones too. Throws InputError: no such topic (names the
/// nearest), or a topic of a type that the sensor cannot come as (names the type found and those accepted).
ChosenTopic choose_topic(const std::map<std::uint32_t, Channel>& connections, Sensor sensor, const std::string& pattern);

/// Insertions, deletions and substitutions that turn one text into the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace kilvo::lab
