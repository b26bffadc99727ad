#include "kilvo/lidar/degeneracy.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kilvo/math/decompositions.hpp"

namespace kilvo {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Sweeps in a row that see the same planes and err alike.
constexpr double alike = 10;

// Scales rotation to metres at the lever of the points: d_scaled = (lever * theta, p).
Vector6 to_metres(double lever) { return (Vector6() << lever, lever, lever, 1, 1, 1).finished(); }

// Of (rotation, position): the rotation to another frame.
Matrix6 rotated(const Eigen::Matrix3d& R) {
  Matrix6 out = Matrix6::Identity();
  out.topLeftCorner<3, 3>() = R;
  return out;
}

Matrix6 scaled(const Matrix6& A, double lever) {
  const Vector6 to_own = to_metres(lever).cwiseInverse();
  return to_own.asDiagonal() * A * to_own.asDiagonal();
}

// The sweep along the eigenvectors of `usual`.
Degeneracy decompose(const SweepInformation& sweep, const Matrix6& usual, double weak_share) {
  Degeneracy out;
  out.position = sweep.A.bottomRightCorner<3, 3>().trace();
  out.lever = std::sqrt(sweep.A.topLeftCorner<3, 3>().trace() / out.position);
  const Matrix6 own = scaled(sweep.A, out.lever), faked = scaled(sweep.fake, out.lever);
  const Eigen::SelfAdjointEigenSolver<Matrix6> eig(scaled(usual, out.lever));
  for (int k = 0; k < 6; ++k) {
    const Vector6 u = eig.eigenvectors().col(k);
    // What is left of a faked direction scatters around zero.
    const double real = u.dot(own * u) - 2.0 * u.dot(faked * u);
    out.smallest_share = std::min(out.smallest_share, real / out.position);
    const bool weak = real < weak_share * out.position;
    if (weak) out.real[static_cast<std::size_t>(out.weak_count)] = real;
    out.directions.col(weak ? out.weak_count++ : 5 - (k - out.weak_count)) = u;
  }
  return out;
}

// Noise E of A turns an eigenvector u towards another one v by v'Eu / (difference of the eigenvalues). E of n planes that are alike has a
// variance of (information along v) * (faked information along u) / n there. `last`: projects to what the sweep before left out.
void doubt_directions(const SweepInformation& sweep, const Matrix6& last, Degeneracy& d) {
  const Matrix6 own = scaled(sweep.A, d.lever), faked = scaled(sweep.fake, d.lever);
  for (int k = 0; k < d.weak_count; ++k) {
    const Vector6 u = d.directions.col(k);
    Matrix6& doubt = d.doubt[static_cast<std::size_t>(k)];
    Vector6 of_sweep = Vector6::Zero(), since_last = Vector6::Zero();
    doubt.setZero();
    for (int j = d.weak_count; j < 6; ++j) {
      const Vector6 v = d.directions.col(j);
      const double information = v.dot(own * v), difference = information - u.dot(own * u);
      if (!(difference > 0)) continue;
      doubt += alike * information * u.dot(faked * u) / (std::max(1, sweep.planes) * difference * difference) * v * v.transpose();
      of_sweep += v.dot(own * u) / difference * v;
      since_last += v.dot(last * u) * v;
    }
    doubt += of_sweep * of_sweep.transpose() + since_last * since_last.transpose();
  }
}

}  // namespace

void BlindDirections::see(const SweepInformation& sweep, const Degeneracy& d) {
  if (d.weak_count == 0) return void(*this = {});
  if (d.turned) sweeps_ = 0;
  mean_ = rotated(sweep.R_WI) * mean_with(sweep) * rotated(sweep.R_WI).transpose();
  sweeps_ = std::min(sweeps_ + 1, memory);
  part_ = weak_part(d);
  share_.add(d.smallest_share, 1);
}

Matrix6 BlindDirections::mean_with(const SweepInformation& sweep) const {
  const Matrix6 own = sweep.A / sweep.A.bottomRightCorner<3, 3>().trace();
  return (sweeps_ * rotated(sweep.R_WI).transpose() * mean_ * rotated(sweep.R_WI) + own) / (sweeps_ + 1);
}

double BlindDirections::confirmed_with(double share, double sigmas) const {
  const double mean = mean_share_with(share), chance = sigmas * share_.sigma() * std::sqrt(alike / (sweeps_ + 1));
  return sweeps_ >= alike && mean > chance ? 1 - chance * chance / (mean * mean) : 0;
}

Degeneracy find_degeneracy(const SweepInformation& sweep, double weak_share, const BlindDirections& before) {
  if (!(sweep.A.topLeftCorner<3, 3>().trace() > 0) || !(sweep.A.bottomRightCorner<3, 3>().trace() > 0)) return {};
  Degeneracy out = decompose(sweep, sweep.A, weak_share);
  if (out.weak_count == 0) return out;
  const Degeneracy usual = decompose(sweep, before.mean_with(sweep), weak_share);
  out.turned = usual.weak_count < out.weak_count;
  if (!out.turned) out = usual;
  // What has become known since the last sweep was measured.
  const Vector6 metres = to_metres(out.lever);
  Matrix6 last = metres.asDiagonal() * before.part() * metres.cwiseInverse().asDiagonal();
  if (last.trace() > out.weak_count + 0.5) last.setZero();
  doubt_directions(sweep, last, out);
  for (std::size_t k = 0; k < 6; ++k)
    out.kept[k] = std::clamp(before.mean_share_with(out.smallest_share) * out.position, 0.0, std::max(0.0, out.real[k]));
  return out;
}

Matrix6 weak_part(const Degeneracy& d, const std::array<double, 6>& share) {
  const Vector6 metres = to_metres(d.lever);
  Matrix6 sum = Matrix6::Zero();
  for (int k = 0; k < d.weak_count; ++k) sum += share[static_cast<std::size_t>(k)] * d.directions.col(k) * d.directions.col(k).transpose();
  return metres.cwiseInverse().asDiagonal() * sum * metres.asDiagonal();
}

std::array<double, 6> along_weak(const Degeneracy& d, const Matrix6& A) {
  const Matrix6 own = scaled(A, d.lever);
  std::array<double, 6> out{};
  for (int k = 0; k < d.weak_count; ++k) out[static_cast<std::size_t>(k)] = d.directions.col(k).dot(own * d.directions.col(k));
  return out;
}

std::array<double, 6> project_out(const Degeneracy& d, const PoseCovariance& prior, double trust, Information<6>& info) {
  std::array<double, 6> taken{};
  if (d.weak_count == 0) return taken;
  const Vector6 metres = to_metres(d.lever), to_own = metres.cwiseInverse();
  const Matrix6 P = metres.asDiagonal() * prior * metres.asDiagonal();
  Matrix6 A = scaled(info.A, d.lever);
  Vector6 b = to_own.asDiagonal() * info.b;
  Matrix6 across = Matrix6::Zero(), kept_A = across;
  Vector6 kept_b = Vector6::Zero();
  for (int k = 0; k < d.weak_count; ++k) {
    const Vector6 u = d.directions.col(k);
    const auto i = static_cast<std::size_t>(k);
    if (const double whole = u.dot(A * u); trust > 0 && whole > 0) {
      // Faked rows see no error: of all rows, b = real * error, with the noise of all.
      const double attenuation = std::min(1.0, d.kept[i] / whole);
      const double weight = trust * attenuation / alike, known = d.kept[i] * weight, variance = u.dot(P * u);
      taken[i] = known * variance / (1 + known * variance);
      kept_A += known * u * u.transpose();
      kept_b += weight * u.dot(b) * u;
    }
    const Matrix6 keep = Matrix6::Identity() - u * u.transpose();
    A = (keep * A * keep).eval();
    b = (keep * b).eval();
    across += u.dot(P * u) * d.doubt[i];
  }
  // Noise common to all rows: (A^-1 + V)^-1 = (I + A V)^-1 A.
  const auto common = (Matrix6::Identity() + A * across).partialPivLu();
  A = common.solve(A).eval();
  b = common.solve(b).eval();
  info.A = metres.asDiagonal() * (0.5 * (A + A.transpose()) + kept_A) * metres.asDiagonal();
  info.b = metres.asDiagonal() * (b + kept_b);
  return taken;
}

}  // namespace kilvo
