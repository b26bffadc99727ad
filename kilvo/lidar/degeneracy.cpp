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
Vector6 to_metres(double lever) { return (Vector6() << lever, lever, lever, 1, 1, 1).finished(); }

}  // namespace

Degeneracy find_degeneracy(const Matrix6& A, const Matrix6& fake, double weak_share) {
  Degeneracy out;
  const double rotation = A.topLeftCorner<3, 3>().trace(), position = A.bottomRightCorner<3, 3>().trace();
  if (!(position > 0) || !(rotation > 0)) return out;
  out.lever = std::sqrt(rotation / position);
  const Vector6 to_own = to_metres(out.lever).cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Matrix6> eig(to_own.asDiagonal() * A * to_own.asDiagonal());
  const Matrix6 faked = to_own.asDiagonal() * fake * to_own.asDiagonal();
  for (int k = 0; k < 6; ++k) {
    const Vector6 u = eig.eigenvectors().col(k);
    // Twice the expected part: what is left of a faked direction scatters around zero.
    const double real = eig.eigenvalues()[k] - 2.0 * u.dot(faked * u);
    out.smallest_share = std::min(out.smallest_share, real / position);
    if (real >= weak_share * position) continue;
    out.real[out.weak_count] = std::max(0.0, real);
    out.weak.col(out.weak_count++) = u;
  }
  return out;
}

Matrix6 weak_part(const Degeneracy& d) {
  const Vector6 metres = to_metres(d.lever);
  return metres.cwiseInverse().asDiagonal() * (d.weak.leftCols(d.weak_count) * d.weak.leftCols(d.weak_count).transpose()) *
         metres.asDiagonal();
}

void project_out(const Degeneracy& d, const PoseCovariance& prior, bool alone, Information<6>& info) {
  if (d.weak_count == 0) return;
  const Vector6 metres = to_metres(d.lever), to_own = metres.cwiseInverse();
  const Matrix6 P = metres.asDiagonal() * prior * metres.asDiagonal();
  Matrix6 A = to_own.asDiagonal() * info.A * to_own.asDiagonal();
  Vector6 b = to_own.asDiagonal() * info.b;
  double across_variance = 0;
  Matrix6 kept_A = Matrix6::Zero();
  Vector6 kept_b = Vector6::Zero();
  for (int k = 0; k < d.weak_count; ++k) {
    const Vector6 u = d.weak.col(k);
    if (const double whole = u.dot(A * u); alone && whole > 0) {
      // Faked rows see no error: of all rows, b = real * error, with the noise of all. The sweeps after see the same planes and err alike.
      constexpr double alike = 10;  // sweeps
      const double attenuation = std::min(1.0, d.real[k] / whole);
      kept_A += d.real[k] * attenuation / alike * u * u.transpose();
      kept_b += attenuation / alike * u.dot(b) * u;
    }
    const Matrix6 keep = Matrix6::Identity() - u * u.transpose();
    A = (keep * A * keep).eval();
    b = (keep * b).eval();
    across_variance += direction_error * direction_error * u.dot(P * u);
  }
  // Noise common to all rows: (A^-1 + v I)^-1 = (I + v A)^-1 A.
  const auto common = (Matrix6::Identity() + across_variance * A).partialPivLu();
  A = common.solve(A).eval();
  b = common.solve(b).eval();
  info.A = metres.asDiagonal() * (0.5 * (A + A.transpose()) + kept_A) * metres.asDiagonal();
  info.b = metres.asDiagonal() * (b + kept_b);
}

}  // namespace kilvo
