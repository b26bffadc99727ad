#include "kilvo/vision/mount_check.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "kilvo/filter/innovation.hpp"
#include "kilvo/math/decompositions.hpp"

namespace kilvo {
namespace {

constexpr int enough_views = 200;
// A careful calibration reaches a tenth of this. What is found is less than what there is: patches that are far off are not found at all.
constexpr double worth_saying = 0.005;  // rad
constexpr double sure = 6;              // standard deviations
constexpr double best_view = 2e-4;      // rad; smallest sigma of a view, for any number of patches
constexpr double alike = 0.01;          // rad; views rotated by less give no information,
constexpr double alike_rate = 0.05;     // rad/s; unless the robot turned at another rate
constexpr double repeated = 20;         // views of the same seconds repeat each other
constexpr double likely_offset = 0.02;  // s

}  // namespace

bool MountCheck::add(const View& image, const View& earlier, const Eigen::Matrix3d& A, const Eigen::Vector3d& b) {
  const SO3 turn = image.R_WI.inverse() * earlier.R_WI;
  Eigen::Matrix<double, 3, 4> H;
  H << turn.matrix() - Eigen::Matrix3d::Identity(), image.omega - turn * earlier.omega;
  if (turn.Log().norm() < alike && H.col(3).norm() < alike_rate) return false;
  // (A^-1 + s^2 I)^-1, of an A that may be singular.
  const Eigen::Matrix3d limited = Eigen::Matrix3d::Identity() + best_view * best_view * A;
  const Eigen::Matrix3d inverse = limited.inverse();
  N_ += H.transpose() * inverse * A * H;
  n_ += H.transpose() * inverse * b;
  ++views_;
  return true;
}

std::optional<double> MountCheck::time_offset(double least) const {
  if (2 * views_ < enough_views) return std::nullopt;
  // The mount is that of the configuration but for a degree or so: where the robot never turned, nothing else holds it.
  Eigen::Matrix3d mount = N_.topLeftCorner<3, 3>();
  mount.diagonal().array() += 1 / (likely_mount * likely_mount);
  const Eigen::Vector3d share = mount.ldlt().solve(N_.topRightCorner<3, 1>());
  const double information = N_(3, 3) - share.dot(N_.topRightCorner<3, 1>());
  if (!(information > 0)) return std::nullopt;
  const double tau = (n_[3] - share.dot(n_.head<3>())) / information;
  if (std::abs(tau) < std::max(least, sure * std::sqrt(repeated / information))) return std::nullopt;
  return usual_loss * tau;
}

std::optional<Eigen::Vector3d> MountCheck::misalignment() const {
  if (views_ < enough_views) return std::nullopt;
  const Eigen::Vector3d with_offset = N_.topRightCorner<3, 1>();
  const double offset = N_(3, 3) + 1 / (likely_offset * likely_offset);
  const Eigen::Matrix3d N = N_.topLeftCorner<3, 3>() - with_offset * with_offset.transpose() / offset;
  const Eigen::Vector3d b = n_.head<3>() - with_offset * n_[3] / offset;
  // Along what was never turned about nothing is known, and nothing is reported.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eig(N);
  Eigen::Vector3d psi = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d axis = eig.eigenvectors().col(k);
    const double information = eig.eigenvalues()[k];
    if (!(information > 0)) continue;
    const double angle = axis.dot(b) / information;
    if (std::abs(angle) > sure * std::sqrt(repeated / information)) psi += angle * axis;
  }
  if (psi.norm() < worth_saying) return std::nullopt;
  return psi;
}

}  // namespace kilvo
