// What values must satisfy beyond their type.
#pragma once

#include "lab/settings/settings.hpp"

namespace kilvo::lab {

/// Ranges and choices of single settings, what several must satisfy together, links and joints that the URDF must have. Throws
/// ConfigError, which says where the setting was made.
void check_settings(const Settings& settings);

}  // namespace kilvo::lab
