#include "lab/doctor/plane_grid.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace kilvo::lab {
namespace {

constexpr double fewest = 12;   // points of a plane
constexpr double refit = 1.25;  // times as many points as at the last fit
constexpr double flat = 0.08;   // of the middle to the smallest eigenvalue
constexpr double most = 20000;  // points of a voxel

}  // namespace

std::int64_t PlaneGrid::key(const Eigen::Vector3d& p) const {
  const auto part = [this](double x) { return (static_cast<std::int64_t>(std::floor(x / side_)) + (1 << 20)) & ((1 << 21) - 1); };
  return (part(p.x()) << 42) | (part(p.y()) << 21) | part(p.z());
}

void PlaneGrid::insert(const Eigen::Vector3d& p) {
  Voxel& v = voxels_[key(p)];
  if (v.n >= most) return;
  // About the voxel's corner, so that squares stay small.
  const Eigen::Vector3d d = p - side_ * (p / side_).array().floor().matrix();
  v.n += 1;
  v.sum += d;
  v.squares += d * d.transpose();
}

void PlaneGrid::fit(Voxel& v, const Eigen::Vector3d& corner) const {
  v.fitted_n = v.n;
  const Eigen::Vector3d mean = v.sum / v.n;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eig(v.squares / v.n - mean * mean.transpose());
  const Eigen::Vector3d& e = eig.eigenvalues();
  const double spread = side_ * side_ / 200;
  v.planar = e[0] < flat * e[1] && e[1] > spread;
  v.plane = {eig.eigenvectors().col(0), corner + mean, std::max(e[0], 0.0)};
}

const GridPlane* PlaneGrid::find(const Eigen::Vector3d& p) {
  const auto it = voxels_.find(key(p));
  if (it == voxels_.end() || it->second.n < fewest) return nullptr;
  Voxel& v = it->second;
  if (v.n >= refit * v.fitted_n) fit(v, side_ * (p / side_).array().floor().matrix());
  return v.planar ? &v.plane : nullptr;
}

}  // namespace kilvo::lab
