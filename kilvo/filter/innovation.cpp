#include "kilvo/filter/innovation.hpp"

#include <Eigen/Cholesky>

namespace kilvo {

template <int N>
std::optional<double> normalised_innovation(const Information<N>& info, const Covariance& P) {
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> A(info.A);
  if (A.info() != Eigen::Success || !(A.vectorD().minCoeff() > 0)) return std::nullopt;
  const Eigen::Matrix<double, 6, 1> d = A.solve(info.b).template head<6>();
  const Eigen::Matrix<double, N, N> of_measurement = A.solve(Eigen::Matrix<double, N, N>::Identity());
  const PoseCovariance S = of_measurement.template topLeftCorner<6, 6>() + P.topLeftCorner<6, 6>();
  return d.dot(S.ldlt().solve(d)) / 6;
}

template std::optional<double> normalised_innovation(const Information<6>&, const Covariance&);
template std::optional<double> normalised_innovation(const Information<7>&, const Covariance&);

}  // namespace kilvo
