// Random numbers that are the same everywhere: splitmix64 and distributions of our own (those of the standard library differ between
// implementations). A stream is named by numbers, so that what one ray draws does not depend on which thread casts it.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace kilvo::lab {

class Random {
 public:
  /// Streams of different names are independent of each other.
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0, std::uint64_t index = 0)
      : state_(mix(mix(mix(seed + golden) ^ (stream + golden)) ^ (index + golden))) {}

  std::uint64_t bits() { return mix(state_ += golden); }

  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Mean 0, variance 1 (Box-Muller).
  double gaussian() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }
  Eigen::Vector3d gaussian3() {
    const double x = gaussian(), y = gaussian();
    return {x, y, gaussian()};
  }

 private:
  static constexpr std::uint64_t golden = 0x9e3779b97f4a7c15;
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

}  // namespace kilvo::lab
