#include "kilvo/vision/brightness.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double Brightness::doubt(double other) const {
  const double d = (other - log) / spread;
  return std::max(1.0, d * d);
}

Brightness brightness_of(std::vector<double> logs) {
  constexpr double of_normal = 1.48, finest = 0.002;  // standard deviation by median deviation; resolution of grey levels
  constexpr int iterations = 8;
  Brightness out{median_of(logs), finest};
  std::vector<double> off(logs.size());
  std::ranges::transform(logs, off.begin(), [&](double x) { return std::abs(x - out.log); });
  out.spread = std::max(finest, of_normal * median_of(std::move(off)));
  for (int k = 0; k < iterations; ++k) {
    double sum = 0, weights = 0;
    for (const double x : logs) {
      const double weight = 1 / out.doubt(x);
      sum += weight * x;
      weights += weight;
    }
    out.log = sum / weights;
    out.sigma = out.spread / std::sqrt(weights);
  }
  return out;
}

}  // namespace kilvo
