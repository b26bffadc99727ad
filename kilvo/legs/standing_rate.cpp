#include "kilvo/legs/standing_rate.hpp"

#include <cmath>

namespace kilvo {
namespace {

constexpr double window = 0.5;        // s
constexpr double surely = 0.9;        // probability of each foot, throughout
constexpr double longest_gap = 0.05;  // s, between samples
// No window says more than this, rad/s: the soles give way, and the next windows say the same.
constexpr double least_sigma = 3e-4;
constexpr double shortest_correlation = 0.01;  // s, of the gyro's noise while the robot stands
// What says less is sway, which is not as white as it is taken: not used, rad/s.
constexpr double largest_sigma = 1e-3;

}  // namespace

void StandingRate::begin(const Feet& feet) {
  begin_ = last_ = feet.t;
  for (std::size_t side = 0; side < 2; ++side) R_IF_[side] = feet.foot[side].R_IF;
  turned_.setZero();
  squares_.setZero();
}

std::optional<GyroBiasReading> StandingRate::add(const Feet& feet, const Contacts& contacts, const Eigen::Vector3d& gyro) {
  // A foot of which only a point is known does not show how the body turns.
  constexpr int fewest_corners = 3;
  const bool stands = contacts.probability[0] > surely && contacts.probability[1] > surely && feet.foot[0].corners >= fewest_corners &&
                      feet.foot[1].corners >= fewest_corners;
  const double dt = begin_ ? to_seconds(feet.t - last_) : 0;
  if (!stands || dt > longest_gap) begin_.reset();
  if (!stands) return std::nullopt;
  if (!begin_) {
    begin(feet);
    return std::nullopt;
  }
  last_ = feet.t;
  turned_ += dt * gyro;
  squares_ += dt * gyro.cwiseAbs2();
  const double time = to_seconds(feet.t - *begin_);
  if (time < window) return std::nullopt;
  // The body's turn between the ends as each sole sees it, R_I0_I1.
  std::array<Eigen::Vector3d, 2> seen;
  for (std::size_t side = 0; side < 2; ++side) seen[side] = (R_IF_[side] * feet.foot[side].R_IF.inverse()).Log() / time;
  const Eigen::Vector3d mean = turned_ / time, variance = (squares_ / time - mean.cwiseAbs2()).cwiseMax(0);
  GyroBiasReading out;
  out.bias = mean - 0.5 * (seen[0] + seen[1]);
  // What the soles do not agree upon, what one sample of the gyro varies by, and what joints and soles that give way may hide of a turn.
  const double turn = 0.5 * (seen[0] + seen[1]).norm();
  out.sigma = std::sqrt(least_sigma * least_sigma + 0.25 * (seen[0] - seen[1]).squaredNorm() + turn * turn +
                        variance.maxCoeff() * shortest_correlation / time);
  begin(feet);
  if (out.sigma > largest_sigma) return std::nullopt;
  return out;
}

}  // namespace kilvo
