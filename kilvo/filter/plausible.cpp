#include "kilvo/filter/plausible.hpp"

#include <Eigen/Cholesky>

namespace kilvo {

bool is_plausible(const Estimate& e) {
  constexpr double absurd_speed = 30, absurd_sigma = 1e4, rounding = 1e-12;  // m/s, m
  return is_finite(e) && e.x.v.norm() < absurd_speed && e.P.diagonal().minCoeff() > -rounding &&
         e.P.diagonal().segment<3>(at::p).maxCoeff() < absurd_sigma * absurd_sigma;
}

bool is_definite(const Covariance& P) {
  constexpr double rounding = 1e-9;
  return P.ldlt().vectorD().minCoeff() > -rounding;
}

}  // namespace kilvo
