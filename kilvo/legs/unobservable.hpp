// What legs do not correct though their rows would, and what they may say of it.
#pragma once

#include <Eigen/Core>

#include "kilvo/filter/gain.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/legs/standing_rate.hpp"

namespace kilvo {

/// Heading and the gyro's bias about the vertical, as unit vectors of the error state. Two soles that stand seem to hold the heading, but
/// they turn on the ground, and always the same way in a turn.
using Heading = Eigen::Matrix<double, at::size, 2>;
Heading heading_of(const State& x);

/// A step of the error state that leaves those as they are.
inline ErrorVector without(const Heading& h, const ErrorVector& d) { return d - h * (h.transpose() * d); }

/// From a prior and its posterior by the gain (P H' L^-T in W): the posterior of an update that leaves them as they are, but knows how all
/// else goes with them (Schmidt's consider states: (I - K H) P (I - K H)' + K R K' with these rows of K zero).
template <int Max>
Estimate considered(const Estimate& prior, const Estimate& posterior, const Gain<Max>& gain) {
  const Heading h = heading_of(prior.x);
  Estimate out = prior;
  out.x = boxplus(prior.x, without(h, boxminus(posterior.x, prior.x)));
  const auto share = (h.transpose() * gain.W()).eval();
  out.P = posterior.P + h * (share * share.transpose()) * h.transpose();
  return out;
}

/// Two feet that stand see how the body turns: the rest of what the gyro says is bias.
Estimate with_gyro_bias(const Estimate& e, const GyroBiasReading& reading);

}  // namespace kilvo
