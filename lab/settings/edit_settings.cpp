#include "lab/settings/edit_settings.hpp"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include "lab/settings/settings.hpp"

namespace kilvo::lab {
namespace {

std::size_t position_of(const YAML::Node& node) { return static_cast<std::size_t>(node.Mark().pos); }

// Behind the value that begins at `begin`: a bracket's partner, a quote's, or the end of a plain word.
std::size_t end_of_value(const std::string& text, std::size_t begin, bool in_flow) {
  const char first = text[begin];
  if (first == '"' || first == '\'') return std::min(text.find(first, begin + 1), text.size() - 1) + 1;
  if (first == '[' || first == '{') {
    int depth = 0;
    for (std::size_t i = begin; i < text.size(); ++i) {
      if (text[i] == '[' || text[i] == '{') ++depth;
      if ((text[i] == ']' || text[i] == '}') && --depth == 0) return i + 1;
    }
    return text.size();
  }
  std::size_t end = begin;
  while (end < text.size() && text[end] != '\n' && !(text[end] == '#' && text[end - 1] == ' ') &&
         !(in_flow && (text[end] == ',' || text[end] == '}' || text[end] == ']')))
    ++end;
  while (end > begin && (text[end - 1] == ' ' || text[end - 1] == '\r')) --end;
  return end;
}

// Of a list or a map over several lines: behind the last value in it.
std::size_t end_of_node(const std::string& text, const YAML::Node& node, bool in_flow) {
  if (node.size() == 0 || node.Style() == YAML::EmitterStyle::Flow) return end_of_value(text, position_of(node), in_flow);
  YAML::Node last;
  for (const auto& entry : node) last.reset(node.IsMap() ? entry.second : YAML::Node(entry));
  return end_of_node(text, last, false);
}

// A new key at the beginning of a map, written as the map is.
std::string with_new_key(const std::string& text, const YAML::Node& map, const std::string& name, const std::string& value) {
  const std::size_t at = position_of(map.begin()->first);
  if (map.Style() == YAML::EmitterStyle::Flow) return std::string(text).insert(at, fmt::format("{}: {}, ", name, value));
  const std::size_t line = text.rfind('\n', at) + 1;  // npos + 1 is 0
  return std::string(text).insert(at, fmt::format("{}: {}\n{}", name, value, std::string(at - line, ' ')));
}

// Anchors, comments and quotes within a value may make its end another one.
bool only_differs_in(const YAML::Node& before, const YAML::Node& after, const std::string& key, const std::string& value) {
  if (!before.IsMap() || !after.IsMap()) return false;
  const std::size_t dot = key.find('.');
  const std::string name = key.substr(0, dot);
  const auto is_concerned = [&](const std::string& other) {
    return other == name || (name == "R" && (other == "q" || other == "rpy"));  // the same rotation
  };
  for (const auto& pair : before) {
    const std::string other = pair.first.Scalar();
    if (!is_concerned(other) && YAML::Dump(pair.second) != YAML::Dump(after[other])) return false;
  }
  for (const auto& pair : after) {
    if (!is_concerned(pair.first.Scalar()) && !before[pair.first.Scalar()].IsDefined()) return false;
  }
  if (dot != std::string::npos) return only_differs_in(before[name], after[name], key.substr(dot + 1), value);
  return YAML::Dump(after[name]) == YAML::Dump(YAML::Load(value));
}

std::string edited(const std::string& yaml, const std::string& key, const std::string& value) {
  try {
    YAML::Node node = YAML::Load(yaml);
    bool in_flow = false;
    for (std::size_t begin = 0; begin <= key.size();) {
      const std::size_t end = std::min(key.find('.', begin), key.size());
      const std::string name = key.substr(begin, end - begin);
      if (!node.IsMap() || node.size() == 0) throw ConfigError(fmt::format("{}: its section is not in the configuration file", key));
      in_flow = in_flow || node.Style() == YAML::EmitterStyle::Flow;
      const YAML::Node next = static_cast<const YAML::Node&>(node)[name];
      if (!next.IsDefined() && name == "R") {
        // The same rotation may be there as a quaternion or as angles.
        for (const auto& pair : node) {
          const std::string other = pair.first.Scalar();
          if (other != "q" && other != "rpy") continue;
          const std::size_t at = position_of(pair.first);
          std::string out = yaml;
          return out.replace(at, end_of_value(yaml, position_of(pair.second), in_flow) - at, fmt::format("R: {}", value));
        }
      }
      if (!next.IsDefined()) {
        if (end != key.size()) throw ConfigError(fmt::format("{}: its section is not in the configuration file", key));
        return with_new_key(yaml, node, name, value);
      }
      node.reset(next);
      begin = end + 1;
    }
    const std::size_t at = position_of(node);
    std::string out = yaml;
    return out.replace(at, end_of_node(yaml, node, in_flow) - at, value);
  } catch (const YAML::Exception& error) {
    throw ConfigError(fmt::format("{}: {}", key, error.what()));
  }
}

}  // namespace

std::string with_setting(const std::string& yaml, const std::string& key, const std::string& value) {
  const std::string out = edited(yaml, key, value);
  const auto refuse = [&] {
    throw ConfigError(fmt::format("{}: the file is written so that it cannot be changed: set it to {}", key, value));
  };
  try {
    if (!only_differs_in(YAML::Load(yaml), YAML::Load(out), key, value)) refuse();
  } catch (const YAML::Exception&) {
    refuse();
  }
  return out;
}

}  // namespace kilvo::lab
