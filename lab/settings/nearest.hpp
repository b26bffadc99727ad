// "Did you mean": the valid name that a mistyped one is closest to.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace kilvo::lab {

/// The candidate that the fewest insertions, deletions, replacements and swaps of neighbours lead to, the first of several; capital
/// letters count as small ones. Empty when there is no candidate.
std::string nearest(std::string_view name, std::span<const std::string> candidates);

}  // namespace kilvo::lab
