// States that the legs do not correct although their rows would, and the part that they may measure.
#pragma once

#include <Eigen/Core>

#include "kilvo/filter/gain.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/legs/standing_rate.hpp"

namespace kilvo {

/// Heading and the gyro's bias about the vertical, as unit vectors of the error state. Two soles that stand seem to hold the heading, but
/// they turn on the ground, and always in the same direction in a turn.
using Heading = Eigen::Matrix<double, at::size, 2>;
Heading heading_of(const State& x);

/// A step of the error state that leaves those as they are.
inline ErrorVector without(const Heading& h, const ErrorVector& d) { return d - h * (h.transpose() * d); }

/// Where the heading is known to no small angle, as after a gap: its error turns the correction of `from`, too. Otherwise a tilt that
/// is corrected makes an unknown heading an unknown tilt, and steps seem to measure it (Huang, Mourikis, Roumeliotis: Observability-based
/// rules for designing consistent EKF SLAM estimators, 2010).
void keep_heading_apart(const State& from, Estimate& e);

/// Makes a posterior by the gain (P H' L^-T in W) that of an update that leaves them as they are, but knows how all else goes with them
/// (Schmidt's consider states: (I - K H) P (I - K H)' + K R K' with these rows of K zero).
template <int Max>
void consider(const State& prior, const Gain<Max>& gain, Estimate& posterior) {
  const Heading h = heading_of(prior);
  posterior.x = boxplus(prior, without(h, boxminus(posterior.x, prior)));
  // h W W' h' = h (share share') h'. Each column of h has one block of three that is not zero, the same in both.
  const Eigen::Vector3d up_I = h.block<3, 1>(at::R, 0);
  double turn = 0, both = 0, bias = 0;
  for (Eigen::Index i = 0; i < gain.rows(); ++i) {
    const double a = up_I.dot(gain.W().template block<3, 1>(at::R, i)), b = up_I.dot(gain.W().template block<3, 1>(at::bg, i));
    turn += a * a;
    both += a * b;
    bias += b * b;
  }
  const Eigen::Matrix3d along = up_I * up_I.transpose();
  posterior.P.block<3, 3>(at::R, at::R) += turn * along;
  posterior.P.block<3, 3>(at::R, at::bg) += both * along;
  posterior.P.block<3, 3>(at::bg, at::R) += both * along;
  posterior.P.block<3, 3>(at::bg, at::bg) += bias * along;
  keep_heading_apart(prior, posterior);
}

/// Two feet in stance measure the body's rotation: the rest of the gyro's rate is bias.
Estimate with_gyro_bias(const Estimate& e, const GyroBiasReading& reading);

}  // namespace kilvo
