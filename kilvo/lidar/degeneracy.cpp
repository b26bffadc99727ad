#include "kilvo/lidar/degeneracy.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kilvo/math/decompositions.hpp"

namespace kilvo {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// How far, in radians, the planes of the map may be wrong about a direction that they do not hold.
constexpr double direction_error = 1e-2;

// Scales rotation to metres at the lever of the points: d_scaled = (lever * theta, p).
Matrix6 scaled(const Matrix6& A, double lever) {
  Matrix6 B = A;
  B.topRows<3>() /= lever;
  B.leftCols<3>() /= lever;
  return B;
}

}  // namespace

Degeneracy find_degeneracy(const Matrix6& A, const Matrix6& fake, double weak_share) {
  Degeneracy out;
  const double rotation = A.topLeftCorner<3, 3>().trace(), position = A.bottomRightCorner<3, 3>().trace();
  if (!(position > 0) || !(rotation > 0)) return out;
  out.lever = std::sqrt(rotation / position);
  const Eigen::SelfAdjointEigenSolver<Matrix6> eig(scaled(A, out.lever));
  const Matrix6 faked = scaled(fake, out.lever);
  for (int k = 0; k < 6; ++k) {
    const Eigen::Matrix<double, 6, 1> u = eig.eigenvectors().col(k);
    // Twice the expected part: what is left of a faked direction scatters around zero.
    const double real = eig.eigenvalues()[k] - 2.0 * u.dot(faked * u);
    out.smallest_share = std::min(out.smallest_share, real / position);
    if (real < weak_share * position) out.weak.col(out.weak_count++) = u;
  }
  return out;
}

Matrix6 weak_part(const Degeneracy& d) {
  Vector6 to_metres;
  to_metres << d.lever, d.lever, d.lever, 1, 1, 1;
  const Matrix6 weak = d.weak.leftCols(d.weak_count) * d.weak.leftCols(d.weak_count).transpose();
  return to_metres.cwiseInverse().asDiagonal() * weak * to_metres.asDiagonal();
}

void project_out(const Degeneracy& d, const PoseCovariance& prior, Information<6>& info) {
  if (d.weak_count == 0) return;
  Vector6 to_metres;
  to_metres << d.lever, d.lever, d.lever, 1, 1, 1;
  const Vector6 to_own = to_metres.cwiseInverse();
  const Matrix6 P = to_metres.asDiagonal() * prior * to_metres.asDiagonal();
  Matrix6 A = to_own.asDiagonal() * info.A * to_own.asDiagonal();
  Vector6 b = to_own.asDiagonal() * info.b;
  double across_variance = 0;
  for (int k = 0; k < d.weak_count; ++k) {
    const Vector6 u = d.weak.col(k);
    const Matrix6 keep = Matrix6::Identity() - u * u.transpose();
    A = (keep * A * keep).eval();
    b = (keep * b).eval();
    across_variance += direction_error * direction_error * u.dot(P * u);
  }
  // Noise common to all rows: (A^-1 + v I)^-1 = (I + v A)^-1 A.
  const auto common = (Matrix6::Identity() + across_variance * A).partialPivLu();
  A = common.solve(A).eval();
  b = common.solve(b).eval();
  info.A = to_metres.asDiagonal() * (0.5 * (A + A.transpose())) * to_metres.asDiagonal();
  info.b = to_metres.asDiagonal() * b;
}

}  // namespace kilvo
