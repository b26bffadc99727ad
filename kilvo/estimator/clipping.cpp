#include "kilvo/estimator/clipping.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kilvo {
namespace {

// A usual range is known to the last bit of 16; values at one end are the same but for rounding.
constexpr double tolerance = 1e-4, rounding = 1e-6;
// No sensor's range ends below, and at rest no value comes near: rad/s, m/s^2.
constexpr double least_gyro = 2.0, least_accel = 15.0;

bool is_near(double value, double end, double share = tolerance) { return std::abs(value - end) < share * end; }

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

// A motion that turns round has more values a little below its largest (`near`) than as large ones (`at`), however coarse the steps.
bool ClippingDetector::count_at(Range::End& end, double size) {
  constexpr double beside = 0.02;
  constexpr int by_chance = 2;  // samples beside a peak
  if (is_near(size, end.largest, rounding)) return ++end.at > std::max(by_chance, end.near);
  if (size < end.largest) {
    end.near += is_near(size, end.largest, beside) ? 1 : 0;
    return false;
  }
  end = {size, 1, is_near(end.largest, size, beside) ? end.near + end.at : 0};
  return false;
}

bool ClippingDetector::is_at_end(const Eigen::Vector3d& v, Range& range, double least, bool is_smooth, bool (*is_usual)(double)) {
  bool at_end = false;
  for (int i = 0; i < 3; ++i) {
    const double size = std::abs(v[i]);
    if (range.given > 0) {
      at_end = at_end || size > (1 - 1e-3) * range.given;
      continue;
    }
    if (size < least) continue;
    Range::End& end = range.ends[static_cast<std::size_t>(2 * i + (v[i] < 0 ? 1 : 0))];
    const bool is_there = is_smooth ? count_at(end, size) : is_near(size, end.largest);
    end.largest = std::max(end.largest, size);
    at_end = at_end || is_there || (is_near(size, end.largest) && is_usual(size));
  }
  return at_end;
}

// Rates are smooth: their largest comes again. Of accelerations, which are rougher, it does not.
void ClippingDetector::mark(ImuSample& s) {
  s.gyro_clipped = is_at_end(s.gyro, gyro_, least_gyro, true, is_usual_gyro);
  s.accel_clipped = is_at_end(s.accel, accel_, least_accel, false, is_usual_accel);
}

}  // namespace kilvo
