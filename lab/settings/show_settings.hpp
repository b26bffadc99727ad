// Settings as text for people: YAML that can be read back, and the tables of docs/parameters.md.
#pragma once

#include <string>

#include "lab/settings/settings.hpp"

namespace kilvo::lab {

/// Every setting with its value, unit, range and meaning, as a configuration file that gives the same settings.
std::string settings_yaml(const Settings& settings);

/// Every setting with its default, unit, range and meaning, as Markdown.
std::string settings_markdown();

/// Every setting that has a value, section by section, as JSON.
std::string settings_json(const Settings& settings);

}  // namespace kilvo::lab
