// The methods of contact estimation by the names of legs.contact, ours beside those that it is compared with.
#pragma once

#include <string>

#include "kilvo/legs/leg_config.hpp"

namespace kilvo::lab {

/// What makes the method of that name (LegConfig::detector); nullptr of ours, which needs none. Throws std::invalid_argument of another
/// name.
decltype(LegConfig::detector) contact_method(const std::string& name);

}  // namespace kilvo::lab
