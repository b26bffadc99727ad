// Is an estimate as good as its covariance says?
#pragma once

#include <Eigen/Core>

#include "kilvo/math/se3.hpp"

namespace kilvo::lab {

/// Normalised estimation error squared e^T P^-1 e with e = [Log(R_est^T R_true); p_true - p_est] (rad, m; rotation perturbed on the right).
/// For a consistent estimate it is chi-square distributed with 6 degrees of freedom: mean 6, variance 12.
/// Throws std::invalid_argument when P is not symmetric positive definite.
double nees(const SE3& estimate, const SE3& truth, const Eigen::Matrix<double, 6, 6>& P);

}  // namespace kilvo::lab
