// What the pixels of one patch say together.
#pragma once

#include <Eigen/Core>

#include "kilvo/vision/patches.hpp"

namespace kilvo {

using Values = std::array<float, Template::count>;

/// r = tau I(u) - tau_r T, summed over the pixels of a patch: A = sum h h', b = sum h r over h = dr/d(u, v, tau), less what the brightness
/// of the patch may have changed by itself.
struct PatchSums {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double mean_square = 0;  // of r, less its mean
  bool saturated = false;
};

/// `variance`: of a pixel's r; `bias_variance`: of what the brightness of the patch may have changed by itself.
PatchSums sums_of(const Template& patch, const Values& image, double tau, double tau_patch, double bias_variance, double variance);

float mean_of(const Values& values);

}  // namespace kilvo
