// What a sensor module hands the filter about one iterate: either sums over many rows (Information) or the few rows themselves (Rows).
// Both define the same cost, 1/2 sum |r + H d|^2 weighted by R^-1, for a step d of the error state at the iterate.
#pragma once

#include <Eigen/Core>
#include <array>

#include "kilvo/filter/state.hpp"

namespace kilvo {

/// Of few rows, at most `Max`; no allocation.
template <int Max>
using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Max, 1>;

/// Beyond this many standard deviations a row's pull stays the same (Huber): what moved, edges, what is not as it was.
inline constexpr double robust_sigmas = 1.5;

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
void add_common_noise(const Eigen::Matrix<double, N, N>& V, Information<N>& info);

/// The same information in at most N rows of unit covariance: A = V L V' gives H = L^1/2 V', r = L^-1/2 V' b. Directions without
/// information drop out, so neither A nor the prior covariance is ever inverted.
template <int N>
Rows<N> as_rows(const Information<N>& info);

// Compiled once, in measurement_rows.cpp, for the sums that there are: of a pose, and of a pose and an exposure.
extern template void add_common_noise(const Eigen::Matrix<double, 6, 6>&, Information<6>&);
extern template void add_common_noise(const Eigen::Matrix<double, 7, 7>&, Information<7>&);
extern template Rows<6> as_rows(const Information<6>&);
extern template Rows<7> as_rows(const Information<7>&);

}  // namespace kilvo
