// Times as text: decimal seconds, to and from integer nanoseconds, never through a double (which keeps only 0.2 us in 2026).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

/// Seconds as "12", "-0.5", "1700010000.123456789" or "1.700010000123456789e+09", exact to the nanosecond; more than 9 decimals
/// are rounded to the nearest. Nothing when `s` is not entirely a number or is outside +-292 years.
std::optional<Time> parse_seconds(std::string_view s);

/// Appends `t` in seconds with 9 decimals: 1700010000.123456789.
void append_seconds(std::string& out, Time t);

/// Appends `x` with 9 decimals, as printf("%.9f") does but about ten times faster and never as "-0.000000000".
void append_fixed9(std::string& out, double x);

/// The same with 1 to 5 decimals, and a sign before a zero as printf() has it.
void append_fixed(std::string& out, double x, int decimals);

}  // namespace kilvo::lab
