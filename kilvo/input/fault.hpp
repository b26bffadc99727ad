// What no sensor measures.
#pragma once

#include <optional>

#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/reason.hpp"

namespace kilvo {

/// What is wrong with a measurement by itself; none: nothing.
std::optional<Reason> fault_of(const ImuSample& s);
std::optional<Reason> fault_of(const JointSample& s);
std::optional<Reason> fault_of(const Measurement& m);

}  // namespace kilvo
