#include "kilvo/filter/innovation.hpp"

#include <Eigen/Cholesky>

namespace kilvo {

std::optional<double> normalised_innovation(const Information<7>& info, const Covariance& P) {
  const Eigen::LDLT<Eigen::Matrix<double, 7, 7>> A(info.A);
  if (A.info() != Eigen::Success || !(A.vectorD().minCoeff() > 0)) return std::nullopt;
  const Eigen::Matrix<double, 6, 1> d = A.solve(info.b).head<6>();
  const Eigen::Matrix<double, 7, 7> of_measurement = A.solve(Eigen::Matrix<double, 7, 7>::Identity());
  const PoseCovariance S = of_measurement.topLeftCorner<6, 6>() + P.topLeftCorner<6, 6>();
  return d.dot(S.ldlt().solve(d)) / 6;
}

}  // namespace kilvo
