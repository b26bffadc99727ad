// The algebra of one step of the update and of the prediction, written out for the sizes of this filter: a dozen rows at most that touch a
// few columns each. General products of matrices take several times as long, since they prepare for large ones.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <type_traits>

#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/filter/state.hpp"

namespace kilvo {

/// W = P H' and the lower triangle of S += H W, column-major; of H (`rows` by at::size, row-major, fewer than at::size) zeros cost nothing.
void project_rows(const Covariance& P, const double* H, int rows, double* S, double* W);

/// How many rows a model may return.
template <class Model>
inline constexpr int most_rows_of = std::remove_cvref_t<std::invoke_result_t<Model, const State&, const Covariance&>>::most;

namespace detail {
/// S (`rows` by `rows`, column-major): its lower triangle becomes L, and the columns of W those of W L^-T.
bool factor(double* S, int rows, double* W, double* inverse);
/// out = P - W W'
void reduce(const Covariance& P, const double* W, int rows, Covariance& out);
}  // namespace detail

/// S = H P H' + R = L L', W = P H' L^-T: the gain is W L^-1 and the posterior covariance P - W W', symmetric by construction.
template <int Max>
class Gain {
  static_assert(Max < at::size);

 public:
  using Columns = Eigen::Matrix<double, at::size, Eigen::Dynamic, 0, at::size, Max>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Max, Max>;

  /// W = P H' and S, of which only the lower triangle.
  void project(const Covariance& P, const Rows<Max>& rows);
  Eigen::Index rows() const { return W_.cols(); }
  Columns& W() { return W_; }
  const Columns& W() const { return W_; }
  Square& S() { return S_; }

  /// From P H' to W, from S to L. False when S is not positive definite.
  bool factor() { return detail::factor(S_.data(), static_cast<int>(S_.rows()), W_.data(), inverse_.data()); }

  /// The step from an iterate at prior [+] e.
  ErrorVector step(const Rows<Max>& rows, const ErrorVector& e) const;

  /// The step from the prior, of rows that are these but for their residual.
  ErrorVector step(const Residual<Max>& r) const {
    return step(r, [](Eigen::Index) { return 0.0; });
  }

  /// The covariance after the step.
  void reduce(const Covariance& P, Covariance& out) const { detail::reduce(P, W_.data(), static_cast<int>(W_.cols()), out); }

 private:
  template <class Known>
  ErrorVector step(const Residual<Max>& r, Known&& known) const;

  Columns W_;
  Square S_;
  std::array<double, static_cast<std::size_t>(Max)> inverse_{};  // of the diagonal of L
};

template <int Max>
void Gain<Max>::project(const Covariance& P, const Rows<Max>& rows) {
  W_.resize(at::size, rows.r.size());
  S_ = rows.R;
  project_rows(P, rows.H.data(), static_cast<int>(rows.r.size()), S_.data(), W_.data());
}

template <int Max>
ErrorVector Gain<Max>::step(const Rows<Max>& rows, const ErrorVector& e) const {
  return step(rows.r, [&](Eigen::Index i) { return rows.H.row(i).dot(e); }) - e;
}

template <int Max>
template <class Known>
ErrorVector Gain<Max>::step(const Residual<Max>& r, Known&& known) const {
  ErrorVector d = ErrorVector::Zero();
  std::array<double, static_cast<std::size_t>(Max)> y;
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    double v = r[i] - known(i);
    for (Eigen::Index k = 0; k < i; ++k) v -= S_(i, k) * y[static_cast<std::size_t>(k)];
    v *= inverse_[static_cast<std::size_t>(i)];
    y[static_cast<std::size_t>(i)] = v;
    d -= v * W_.col(i);
  }
  return d;
}

}  // namespace kilvo
