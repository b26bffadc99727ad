// How long something took, many times over: quantiles to one part in a hundred, in a fixed amount of memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace kilvo::live {

class Latency {
 public:
  void add(double seconds);
  /// The smallest time, s, that a share `q` of all did not exceed; 0 when there were none.
  double quantile(double q) const;
  double max() const { return max_; }
  std::uint64_t count() const { return count_; }

 private:
  // From 0.1 us to 100 s, each bin one hundredth wider than the one before.
  static constexpr double least = 1e-7, ratio = 1.01;
  static constexpr std::size_t bins = 2084;
  std::array<std::uint64_t, bins> counts_{};
  std::uint64_t count_ = 0;
  double max_ = 0;
};

}  // namespace kilvo::live
