#include "lab/evaluation/decimal_time.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>

namespace kilvo::lab {
namespace {

constexpr std::int64_t max_ns = std::numeric_limits<std::int64_t>::max();

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// value * 10 + digit, or false when that does not fit.
bool push_digit(std::int64_t& value, int digit) {
  if (value > (max_ns - digit) / 10) return false;
  value = value * 10 + digit;
  return true;
}

bool skip_sign(std::string_view& s) {
  const bool negative = !s.empty() && s.front() == '-';
  if (!s.empty() && (s.front() == '-' || s.front() == '+')) s.remove_prefix(1);
  return negative;
}

/// Cuts "e+09" off the end of `s` and returns 9; 0 when there is none.
std::optional<int> take_exponent(std::string_view& s) {
  const auto e = s.find_first_of("eE");
  if (e == std::string_view::npos) return 0;
  std::string_view digits = s.substr(e + 1);
  s = s.substr(0, e);
  const bool negative = skip_sign(digits);
  int exponent = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
  if (digits.empty() || !is_digit(digits.front()) || error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  exponent = std::min(exponent, 100000);  // as good as any larger one
  return negative ? -exponent : exponent;
}

/// A number of units of the last of so many decimals.
void append_decimals(std::string& out, std::int64_t n, int decimals) {
  char buffer[32];
  char* p = buffer + sizeof(buffer);
  auto rest = n < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(n) : static_cast<std::uint64_t>(n);
  for (int i = 0; i <= decimals || rest > 0; ++i) {
    if (i == decimals) *--p = '.';
    *--p = static_cast<char>('0' + rest % 10);
    rest /= 10;
  }
  if (n < 0) *--p = '-';
  out.append(p, buffer + sizeof(buffer));
}

}  // namespace

std::optional<Time> parse_seconds(std::string_view s) {
  const bool negative = skip_sign(s);
  const auto exponent = take_exponent(s);
  if (!exponent) return std::nullopt;
  const auto point = std::min(s.find('.'), s.size());
  std::int64_t ns = 0;
  int place = static_cast<int>(point) - 1 + *exponent + 9;  // the power of ten, in ns, of the next digit
  bool any_digit = false, round_up = false;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (i == point) continue;
    if (!is_digit(s[i])) return std::nullopt;
    any_digit = true;
    if (place >= 0 && !push_digit(ns, s[i] - '0')) return std::nullopt;
    if (place == -1) round_up = s[i] >= '5';
    --place;
  }
  if (!any_digit) return std::nullopt;
  for (; place >= 0 && ns > 0; --place)
    if (!push_digit(ns, 0)) return std::nullopt;
  if (round_up && ns < max_ns) ++ns;
  return time_from_ns(negative ? -ns : ns);
}

void append_seconds(std::string& out, Time t) { append_decimals(out, to_ns(t), 9); }

void append_fixed9(std::string& out, double x) {
  if (std::abs(x) < 9e9) return append_decimals(out, std::llround(x * 1e9), 9);
  char buffer[352];  // the largest double has 309 digits before the point
  out.append(buffer, static_cast<std::size_t>(std::snprintf(buffer, sizeof(buffer), "%.9f", x)));
}

void append_fixed(std::string& out, double x, int decimals) {
  constexpr double powers[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5};
  if (std::abs(x) < 9e9) {
    const std::int64_t n = std::llrint(x * powers[decimals]);
    if (n == 0 && std::signbit(x)) out += '-';
    return append_decimals(out, n, decimals);
  }
  char buffer[352];
  out.append(buffer, static_cast<std::size_t>(std::snprintf(buffer, sizeof(buffer), "%.*f", decimals, x)));
}

}  // namespace kilvo::lab
