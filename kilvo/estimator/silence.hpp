// After how long without a message a sensor counts as lost.
#pragma once

#include <algorithm>

#include "kilvo/sensors/time.hpp"

namespace kilvo {

/// theta_s of Eq. 16: so many periods, but no less than `least`.
inline Duration silence(double rate, double periods, Duration least) { return std::max(least, from_seconds(periods / rate)); }

}  // namespace kilvo
