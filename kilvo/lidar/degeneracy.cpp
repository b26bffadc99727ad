#include "kilvo/lidar/degeneracy.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

namespace kilvo {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Scales rotation to metres at the lever of the points: d_scaled = (lever * theta, p).
Matrix6 scaled(const Matrix6& A, double lever) {
  Matrix6 B = A;
  B.topRows<3>() /= lever;
  B.leftCols<3>() /= lever;
  return B;
}

}  // namespace

Degeneracy find_degeneracy(const Matrix6& A, const Matrix6& fake, double weak_direction) {
  Degeneracy out;
  const double rotation = A.topLeftCorner<3, 3>().trace(), position = A.bottomRightCorner<3, 3>().trace();
  if (!(position > 0) || !(rotation > 0)) return out;
  out.lever = std::sqrt(rotation / position);
  const Eigen::SelfAdjointEigenSolver<Matrix6> eig(scaled(A, out.lever));
  const Matrix6 faked = scaled(fake, out.lever);
  out.smallest_information = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 6; ++k) {
    const Eigen::Matrix<double, 6, 1> u = eig.eigenvectors().col(k);
    // Twice the expected part: what is left of a faked direction scatters around zero.
    const double real = eig.eigenvalues()[k] - 2.0 * u.dot(faked * u);
    out.smallest_information = std::min(out.smallest_information, real);
    if (real < 1.0 / (weak_direction * weak_direction)) out.weak.col(out.weak_count++) = u;
  }
  return out;
}

void project_out(const Degeneracy& d, Information<6>& info) {
  for (int k = 0; k < d.weak_count; ++k) {
    Eigen::Matrix<double, 6, 1> u = d.weak.col(k);
    // In unscaled coordinates the step along u is S^-1 u; its conjugate, for information, is S u.
    Eigen::Matrix<double, 6, 1> step = u, conjugate = u;
    step.head<3>() /= d.lever;
    conjugate.head<3>() *= d.lever;
    const Matrix6 keep = Matrix6::Identity() - conjugate * step.transpose();
    info.A = (keep * info.A * keep.transpose()).eval();
    info.b = (keep * info.b).eval();
  }
}

}  // namespace kilvo
