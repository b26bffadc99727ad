// The manifold state and its estimate (paper, Eq. 1, with one contact position per foot).
#pragma once

#include <Eigen/Core>
#include <array>

#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo {

inline constexpr double standard_gravity = 9.80665;  // m/s^2

/// Where each part of the state stands in the error vector (rotation: right perturbation, rad).
namespace at {
inline constexpr int R = 0, p = 3, v = 6, bg = 9, ba = 12, g = 15, pcl = 18, pcr = 21, tau = 24;
inline constexpr int size = 25;
}  // namespace at

using ErrorVector = Eigen::Matrix<double, at::size, 1>;
using Covariance = Eigen::Matrix<double, at::size, at::size>;
using PoseCovariance = Eigen::Matrix<double, 6, 6>;  // of (rotation, position)

struct State {
  SO3 R;                                          // R_WI
  Eigen::Vector3d p = Eigen::Vector3d::Zero();    // IMU in the world, m
  Eigen::Vector3d v = Eigen::Vector3d::Zero();    // in the world, m/s
  Eigen::Vector3d bg = Eigen::Vector3d::Zero();   // gyro bias, rad/s
  Eigen::Vector3d ba = Eigen::Vector3d::Zero();   // accelerometer bias, m/s^2
  Eigen::Vector3d g = {0, 0, -standard_gravity};  // gravity in the world, m/s^2; its length never changes
  std::array<Eigen::Vector3d, 2> pc = {Eigen::Vector3d::Zero(),
                                       Eigen::Vector3d::Zero()};  // contact positions in the world, left and right, m
  double tau = 1;                                                 // inverse camera exposure, relative to the first image

  SE3 pose() const { return {R, p}; }
};

/// x [+] d: R Exp(d_R), the rest added; gravity keeps its length.
State boxplus(const State& x, const ErrorVector& d);

/// a [-] b: the d for which b [+] d is a.
ErrorVector boxminus(const State& a, const State& b);

/// State and covariance of its error, at a time. A value: copied freely.
struct Estimate {
  Time t{};
  State x;
  Covariance P = Covariance::Zero();
};

/// The frame of position and heading restarts at this pose: both are known exactly in it, and what depended on their errors is relative
/// to them. Inclination, biases and the amount of the velocity keep theirs.
void begin_frame(Estimate& e);

bool is_finite(const Estimate& e);

/// m/s: beyond it nothing walks.
inline constexpr double absurd_speed = 30;

/// Finite, at a speed that a walking machine may have, with variances that are none of a state that has lost itself.
bool is_plausible(const Estimate& e);

/// Whether a covariance has no negative direction, but for rounding: what is known exactly, and feet that do not stand, have no variance.
bool is_definite(const Covariance& P);

}  // namespace kilvo
