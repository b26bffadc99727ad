#include "lab/evaluation/consistency.hpp"

#include <Eigen/Cholesky>
#include <stdexcept>

namespace kilvo::lab {

double nees(const SE3& estimate, const SE3& truth, const Eigen::Matrix<double, 6, 6>& P) {
  if (!P.isApprox(P.transpose(), 1e-9)) throw std::invalid_argument("nees: the covariance is not symmetric");
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> cholesky(P);
  if (cholesky.info() != Eigen::Success) throw std::invalid_argument("nees: the covariance is not positive definite");
  Eigen::Matrix<double, 6, 1> e;
  e << (estimate.R.inverse() * truth.R).Log(), truth.p - estimate.p;
  return cholesky.matrixL().solve(e).squaredNorm();
}

}  // namespace kilvo::lab
