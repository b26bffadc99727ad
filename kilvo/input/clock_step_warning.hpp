// What the user is told of a step of the IMU's clock.
#pragma once

#include <cmath>
#include <string>

#include "kilvo/input/clock_steps.hpp"
#include "kilvo/math/decimals.hpp"

namespace kilvo {

inline std::string warning_of_last(const ClockSteps& steps) {
  const double back = to_seconds(steps.last());
  return std::string("the IMU's clock went ") + (back > 0 ? "back" : "ahead") + " by " + decimals(1e3 * std::abs(back), 0) +
         " ms: the outputs' stamps go on as if it had not";
}

}  // namespace kilvo
