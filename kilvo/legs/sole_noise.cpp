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
// Two stances whose squares both exceed this many variances of the noise need no more.
constexpr double surely = 3;

}  // namespace

SoleNoise::SoleNoise(const LegConfig& config)
    : config_(config),
      across_(first_guess * first_guess, 0, prior_averages, memory_averages),
      upwards_(config.vertical_velocity_sigma * config.vertical_velocity_sigma, 0, prior_averages, memory_averages),
      alike_(0, 0, prior_averages, memory_averages) {}

void SoleNoise::add(std::size_t side, const Eigen::Vector3d& velocity_W, const Eigen::Vector3d& up_W, double dt,
                    std::optional<double> sigma_v) {
  Sum& sum = sum_[side];
  sum.way += dt * velocity_W;
  sum.time += dt;
  if (sum.time < config_.velocity_correlation) return;
  const Eigen::Vector3d mean = sum.way / sum.time;
  const double up = up_W.dot(mean);
  sum = {};
  if (!mean.allFinite()) return;  // of a state that is discarded
  across_.add(0.5 * (mean.squaredNorm() - up * up), 1);
  if (sigma_v) {
    add_rise(side, up, *sigma_v * *sigma_v);
  } else {
    restart();
    upwards_.add(up * up, 1);
    knows_vertical_ = true;
  }
}

void SoleNoise::restart() {
  last_rise_ = {};
  alike_ = RunningStatistics(0, 0, prior_averages, memory_averages);
}

void SoleNoise::add_rise(std::size_t side, double up, double variance_v) {
  const auto other = std::exchange(last_rise_[1 - side], std::nullopt);
  last_rise_[side] = up;
  if (!other) return;
  const double both = up * *other, noise2 = vertical() * vertical();
  upwards_.add(0.5 * (up - *other) * (up - *other), 1);
  alike_.add(both, 1);
  const double at_once = both > 0 ? std::min(up * up, *other * *other) - surely * noise2 : 0;
  const double beyond = std::max(alike_.mean(), at_once) - variance_v;
  if (beyond > 0) rise_ = std::sqrt(beyond);
}

double SoleNoise::horizontal() const { return std::max(config_.velocity_sigma, common * std::sqrt(across_.mean())); }
double SoleNoise::vertical() const {
  const double learnt = std::sqrt(upwards_.mean());
  return knows_vertical_ ? std::max(config_.velocity_sigma, common * learnt) : std::max(config_.vertical_velocity_sigma, learnt);
}

}  // namespace kilvo
