// Sums over the pixels of one patch.
#pragma once

#include <Eigen/Core>

#include "kilvo/vision/patches.hpp"

namespace kilvo {

using Values = std::array<float, Template::count>;

/// r = tau I(u) - tau_r T, summed over the pixels of a patch: A = sum h h', b = sum h r over h = dr/d(u, v, tau).
struct PatchSums {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  Eigen::Vector3d h = Eigen::Vector3d::Zero();  // sum h
  double r = 0;                                 // sum r
  double mean_square = 0;                       // of r, less its mean
  bool saturated = false;

  /// Takes out what the brightness of the patch may have changed by itself: `bias_variance`, of r; `variance` is that of a pixel's r.
  void allow(double bias_variance, double variance);
};

PatchSums sums_of(const Template& patch, const Values& image, double tau, double tau_patch);

float mean_of(const Values& values);
float top_of(const Values& values);

/// Whether the brightest pixel of a patch cannot be compared where it is expected to be as bright as `expected`.
bool is_saturated(float top, double expected);

}  // namespace kilvo
