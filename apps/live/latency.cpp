#include "apps/live/latency.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo::live {

void Latency::add(double seconds) {
  const double bin = std::ceil(std::log(std::max(seconds, least) / least) / std::log(ratio));
  ++counts_[std::min(bins - 1, static_cast<std::size_t>(bin))];
  ++count_;
  max_ = std::max(max_, seconds);
}

double Latency::quantile(double q) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < bins; ++i) {
    seen += counts_[i];
    if (seen >= wanted && count_ > 0) return std::min(max_, least * std::pow(ratio, static_cast<double>(i)));
  }
  return 0;
}

}  // namespace kilvo::live
