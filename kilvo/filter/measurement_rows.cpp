#include "kilvo/filter/measurement_rows.hpp"

#include <Eigen/LU>
#include <cmath>

#include "kilvo/math/decompositions.hpp"

namespace kilvo {

template <int N>
void add_common_noise(const Eigen::Matrix<double, N, N>& V, Information<N>& info) {
  const auto common = (Eigen::Matrix<double, N, N>::Identity() + info.A * V).partialPivLu();
  const Eigen::Matrix<double, N, N> A = common.solve(info.A);
  info.A = 0.5 * (A + A.transpose());
  info.b = common.solve(info.b).eval();
}

template <int N>
Rows<N> as_rows(const Information<N>& info) {
  // Columns in different units (rad, m): scaled to unit diagonal before the eigenvalues are compared.
  Eigen::Matrix<double, N, 1> scale;
  for (int i = 0; i < N; ++i) scale[i] = info.A(i, i) > 0 ? 1.0 / std::sqrt(info.A(i, i)) : 0.0;
  const Eigen::Matrix<double, N, N> scaled = scale.asDiagonal() * info.A * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eig(scaled);
  constexpr double relative_floor = 1e-12;

  Rows<N> out;
  int count = 0;
  for (int k = 0; k < N; ++k) count += eig.eigenvalues()[k] > relative_floor ? 1 : 0;
  out.r.resize(count);
  out.H.setZero(count, at::size);
  out.R.setIdentity(count, count);
  int row = 0;
  for (int k = 0; k < N; ++k) {
    const double lambda = eig.eigenvalues()[k];
    if (!(lambda > relative_floor)) continue;
    const double root = std::sqrt(lambda);
    out.r[row] = eig.eigenvectors().col(k).dot(scale.cwiseProduct(info.b)) / root;
    for (int i = 0; i < N; ++i) {
      out.H(row, info.columns[static_cast<std::size_t>(i)]) = scale[i] > 0 ? root * eig.eigenvectors()(i, k) / scale[i] : 0.0;
    }
    ++row;
  }
  return out;
}

template void add_common_noise(const Eigen::Matrix<double, 6, 6>&, Information<6>&);
template void add_common_noise(const Eigen::Matrix<double, 7, 7>&, Information<7>&);
template Rows<6> as_rows(const Information<6>&);
template Rows<7> as_rows(const Information<7>&);

}  // namespace kilvo
