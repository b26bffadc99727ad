#include "kilvo/estimator/clipping.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kilvo {
namespace {

// Values of one end differ by no more than the last bit of 16.
constexpr double tolerance = 1e-4;
// No sensor's range ends below, and at rest no value comes near: rad/s, m/s^2.
constexpr double least_gyro = 2.0, least_accel = 15.0;

bool is_near(double value, double end) { return std::abs(value - end) < tolerance * end; }

bool is_usual_gyro(double rate) {
  constexpr std::array degrees = {125.0, 245.0, 250.0, 400.0, 500.0, 1000.0, 2000.0};
  return std::ranges::any_of(degrees, [rate](double d) { return is_near(rate, d * std::numbers::pi / 180); });
}

bool is_usual_accel(double accel) {
  constexpr std::array multiples = {2.0, 3.0, 4.0, 6.0, 8.0, 16.0};
  constexpr std::array units = {9.8, 9.80665, 9.81};
  return std::ranges::any_of(multiples,
                             [&](double k) { return std::ranges::any_of(units, [&](double g) { return is_near(accel, k * g); }); });
}

}  // namespace

bool ClippingDetector::is_at_end(const Eigen::Vector3d& v, Range& range, double least, bool (*is_usual)(double)) {
  bool at_end = false;
  for (int i = 0; i < 3; ++i) {
    const double size = std::abs(v[i]);
    if (range.given > 0) {
      at_end = at_end || size > (1 - 1e-3) * range.given;
      continue;
    }
    if (size < least) continue;
    double& largest = range.largest[static_cast<std::size_t>(2 * i + (v[i] < 0 ? 1 : 0))];
    at_end = at_end || is_near(size, largest) || (size > largest && is_usual(size));
    largest = std::max(largest, size);
  }
  return at_end;
}

void ClippingDetector::mark(ImuSample& s) {
  s.gyro_clipped = is_at_end(s.gyro, gyro_, least_gyro, is_usual_gyro);
  s.accel_clipped = is_at_end(s.accel, accel_, least_accel, is_usual_accel);
}

}  // namespace kilvo
