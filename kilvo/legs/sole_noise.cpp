#include "kilvo/legs/sole_noise.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

constexpr double prior_averages = 3, memory_averages = 15;
// Before anything is known of the soles, m/s.
constexpr double first_guess = 0.1;
// The state follows the sole in part, so that less is seen than there is; and what is alike at all steps does not average out.
constexpr double common = 2;

}  // namespace

SoleNoise::SoleNoise(const LegConfig& config)
    : config_(config),
      across_(first_guess * first_guess, 0, prior_averages, memory_averages),
      upwards_(config.vertical_velocity_sigma * config.vertical_velocity_sigma, 0, prior_averages, memory_averages) {}

void SoleNoise::add(std::size_t side, const Eigen::Vector3d& velocity_W, const Eigen::Vector3d& up_W, double dt) {
  Sum& sum = sum_[side];
  sum.way += dt * velocity_W;
  sum.time += dt;
  if (sum.time < config_.velocity_correlation) return;
  const Eigen::Vector3d mean = sum.way / sum.time;
  const double up = up_W.dot(mean);
  across_.add(0.5 * (mean.squaredNorm() - up * up), 1);
  upwards_.add(up * up, 1);
  sum = {};
}

double SoleNoise::horizontal() const { return std::max(config_.velocity_sigma, common * std::sqrt(across_.mean())); }
double SoleNoise::vertical() const { return std::max(config_.vertical_velocity_sigma, common * std::sqrt(upwards_.mean())); }

}  // namespace kilvo
