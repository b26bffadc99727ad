#include "lab/simulation/sensor_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/simulation/random.hpp"
#include "lab/simulation/units.hpp"

namespace kilvo::lab {
namespace {

using std::numbers::pi;
constexpr std::uint64_t material_stream = 61;

// How much longer a beam's spot is on a grazed surface than on one that it meets upright: 0 to 1 at 75 degrees, constant from 80 on.
double grazed(double cosine) {
  constexpr double at_75 = 2.8637;
  return (1 / std::max(0.17, cosine) - 1) / at_75;
}

// The forearms of a robot that carries its LiDAR in the head, in the housing's angles: azimuth, elevation, rad.
constexpr double arm_azimuth = 55 * degree, arm_low = 28 * degree, arm_high = 43 * degree;
// What the LiDAR sees in elevation, rad.
constexpr double field = 59 * degree;
// They swing by so much, m, once in so many seconds.
constexpr double arm_swing = 0.02, arm_period = 0.8;
constexpr double drift_period = 9;  // s, of the white balance

}  // namespace

double ImuErrors::warmth(double t) const { return 1 - std::exp(-t / warm_up); }

double LidarErrors::sigma(double cosine, double range) const {
  const double weakness = 0.6 * std::min(1.0, grazed(cosine)) + 0.4 * std::min(1.0, range / 20);
  return least_sigma + (most_sigma - least_sigma) * weakness;
}

double LidarErrors::bias(double cosine, std::size_t material) const {
  return incidence_bias * grazed(cosine) + Random(seed, material_stream, material).uniform(-material_bias, material_bias);
}

std::optional<double> LidarErrors::arm(const Eigen::Vector3d& direction, double t) const {
  const double elevation = std::asin(std::clamp(direction.z(), -1.0, 1.0));
  if (elevation < arm_low || elevation > arm_high) return std::nullopt;
  const double azimuth = std::atan2(direction.y(), direction.x());
  const double width = arms / 2 * 2 * pi * field / (arm_high - arm_low);  // of each window, so that the share of all points is right
  if (std::abs(std::abs(azimuth) - arm_azimuth) > width / 2) return std::nullopt;
  const double swing = std::copysign(arm_swing, azimuth) * std::sin(2 * pi * t / arm_period);
  return 0.35 + 0.02 * (arm_high - elevation) / degree + swing;
}

std::array<float, 3> CameraErrors::tint(double t) const {
  const auto drift = [&](double phase) { return static_cast<float>(1 + white_balance * std::sin(2 * pi * t / drift_period + phase)); };
  return {drift(phases[0]), 1, drift(phases[1])};
}

float CameraErrors::response(float linear) const { return 255 * std::pow(std::max(0.0F, linear) / 255, static_cast<float>(1 / gamma)); }

}  // namespace kilvo::lab
