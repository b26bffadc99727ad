// Units that are written out where angles are given.
#pragma once

#include <numbers>

namespace kilvo::lab {

inline constexpr double degree = std::numbers::pi / 180;

}  // namespace kilvo::lab
