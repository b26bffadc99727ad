#include "kilvo/vision/mount_check.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace kilvo {
namespace {

constexpr int enough_views = 200;
// A careful calibration reaches a tenth of this. What is found is less than what there is: patches that are far off are not found at all.
constexpr double worth_saying = 0.005;  // rad
constexpr double sure = 6;              // standard deviations
constexpr double best_view = 2e-4;      // rad; no view says more than this, however many patches it has
constexpr double alike = 0.01;          // rad; views that are turned by less say nothing

}  // namespace

void MountCheck::add(const SO3& R_c, const SO3& R_r, const Eigen::Matrix3d& A, const Eigen::Vector3d& b) {
  const SO3 turn = R_c.inverse() * R_r;
  if (turn.Log().norm() < alike) return;
  const Eigen::Matrix3d H = turn.matrix() - Eigen::Matrix3d::Identity();
  // (A^-1 + s^2 I)^-1, of an A that may be singular.
  const Eigen::Matrix3d limited = Eigen::Matrix3d::Identity() + best_view * best_view * A;
  const Eigen::Matrix3d inverse = limited.inverse();
  N_ += H.transpose() * inverse * A * H;
  n_ += H.transpose() * inverse * b;
  ++views_;
}

std::optional<Eigen::Vector3d> MountCheck::misalignment() const {
  if (views_ < enough_views) return std::nullopt;
  // Along what was never turned about nothing is known, and nothing is said.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eig(N_);
  Eigen::Vector3d psi = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d axis = eig.eigenvectors().col(k);
    const double information = eig.eigenvalues()[k];
    if (!(information > 0)) continue;
    const double angle = axis.dot(n_) / information;
    // Views of the same seconds repeat each other.
    constexpr double repeated = 20;
    if (std::abs(angle) > sure * std::sqrt(repeated / information)) psi += angle * axis;
  }
  if (psi.norm() < worth_saying) return std::nullopt;
  return psi;
}

}  // namespace kilvo
