// What a sense hands the filter about one iterate: either sums over many rows (Information) or the few rows themselves (Rows).
// Both speak of the same cost, 1/2 sum |r + H d|^2 weighted by R^-1, for a step d of the error state at the iterate.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "kilvo/filter/state.hpp"

namespace kilvo {

/// Of few rows, at most `Max`; no allocation.
template <int Max>
using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Max, 1>;

/// Few rows: residual r, Jacobian H over the whole error state, covariance R of the rows. At most `Max` rows; no allocation.
template <int Max>
struct Rows {
  static constexpr int most = Max;
  Residual<Max> r;
  Eigen::Matrix<double, Eigen::Dynamic, at::size, Eigen::RowMajor, Max, at::size> H;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Max, Max> R;
};

/// Many rows, summed: A = sum H' R^-1 H, b = sum H' R^-1 r over the `N` columns of the error state that they touch.
template <int N>
struct Information {
  static constexpr int most = N;  // rows, when it is turned into some
  std::array<int, N> columns{};
  Eigen::Matrix<double, N, N> A = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> b = Eigen::Matrix<double, N, 1>::Zero();
  double chi2 = 0;  // sum r' R^-1 r
  int rows = 0;
};

/// Adds noise of covariance V that all rows share: (A^-1 + V)^-1 = (I + A V)^-1 A, with A that may be singular.
template <int N>
void add_common_noise(const Eigen::Matrix<double, N, N>& V, Information<N>& info) {
  const auto common = (Eigen::Matrix<double, N, N>::Identity() + info.A * V).partialPivLu();
  const Eigen::Matrix<double, N, N> A = common.solve(info.A);
  info.A = 0.5 * (A + A.transpose());
  info.b = common.solve(info.b).eval();
}

template <int Max>
const Rows<Max>& as_rows(const Rows<Max>& rows) {
  return rows;
}

/// The same information in at most N rows of unit covariance: A = V L V' gives H = L^1/2 V', r = L^-1/2 V' b. Directions without
/// information drop out, so neither A nor the prior covariance is ever inverted.
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

}  // namespace kilvo
