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

void SoleNoise::add(std::size_t side, const Eigen::Vector3d& velocity_W, const Eigen::Vector3d& up_W, double dt,
                    std::optional<double> sigma_v) {
  Sum& sum = sum_[side];
  sum.way += dt * velocity_W;
  sum.time += dt;
  if (sum.time < config_.velocity_correlation) return;
  const Eigen::Vector3d mean = sum.way / sum.time;
  const double up = up_W.dot(mean);
  across_.add(0.5 * (mean.squaredNorm() - up * up), 1);
  if (sigma_v) {
    add_rise(side, up, *sigma_v * *sigma_v);
  } else {
    restart();
    upwards_.add(up * up, 1);
  }
  sum = {};
}

void SoleNoise::restart() {
  last_rise_ = {};
  rises_ = 0;
}

void SoleNoise::add_rise(std::size_t side, double up, double variance_v) {
  // What both feet show, beyond three standard deviations.
  constexpr double beyond = 9;
  const double variance = vertical() * vertical();
  const double other = last_rise_[1 - side].value_or(0), both = up * other > 0 ? std::min(std::abs(up), std::abs(other)) : 0;
  last_rise_[side] = up;
  if (both * both > beyond * (variance_v + 0.5 * variance)) {
    rise_ = 0.5 * (up + other);
    restart();
    sum_ = {};
    return;
  }
  // What is alike at all steps is an error of the state; one average alone must not raise the noise.
  rises_ = std::min(rises_ + 1, memory_averages);
  const double off = up - (rises_ > 1 ? usual_rise_ : 0);
  usual_rise_ = up - off * (1 - 1 / rises_);
  if (rises_ > 1) upwards_.add((1 - 1 / rises_) * std::min(off * off, variance_v + 0.5 * variance), 1);
}

double SoleNoise::horizontal() const { return std::max(config_.velocity_sigma, common * std::sqrt(across_.mean())); }
double SoleNoise::vertical() const { return std::max(config_.vertical_velocity_sigma, common * std::sqrt(upwards_.mean())); }

}  // namespace kilvo
