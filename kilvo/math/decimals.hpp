// Numbers in warnings.
#pragma once

#include <cmath>
#include <string>

namespace kilvo {

/// Rounded to so many digits after the point: decimals(1.26, 1) is "1.3".
inline std::string decimals(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  std::string text = std::to_string(std::round(scale * value) / scale);
  text.resize(text.find('.') + (digits > 0 ? static_cast<std::size_t>(digits) + 1 : 0));
  return text;
}

}  // namespace kilvo
