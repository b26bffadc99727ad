#include "lab/doctor/plane_grid.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace kilvo::lab {
namespace {

constexpr double fewest = 12;   // points of a plane
constexpr double refit = 1.25;  // times as many points as at the last fit
constexpr double flat = 0.08;   // of the middle to the smallest eigenvalue
constexpr double most = 20000;  // points of a voxel

constexpr std::size_t first_slots = 1024;

// floor() without a call.
Eigen::Vector3d floor_of(const Eigen::Vector3d& x) {
  Eigen::Vector3d out;
  for (int i = 0; i < 3; ++i) {
    const auto down = static_cast<double>(static_cast<std::int64_t>(x[i]));
    out[i] = down > x[i] ? down - 1 : down;
  }
  return out;
}

}  // namespace

PlaneGrid::PlaneGrid(double side) : side_(side), slots_(first_slots) {}

std::uint64_t PlaneGrid::key_of(const Eigen::Vector3d& cell) {
  const auto part = [](double x) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(x) + (1 << 20)) & ((1 << 21) - 1); };
  return (part(cell.x()) << 42) | (part(cell.y()) << 21) | part(cell.z());
}

// Where the voxel of this key is, or would be.
std::size_t PlaneGrid::slot_of(std::uint64_t key) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t i = (key * 0x9E3779B97F4A7C15ULL >> 32) & mask;
  while (slots_[i].voxel != none && slots_[i].key != key) i = (i + 1) & mask;
  return i;
}

void PlaneGrid::grow() {
  std::vector<Slot> old(2 * slots_.size());
  old.swap(slots_);
  for (const Slot& slot : old) {
    if (slot.voxel != none) slots_[slot_of(slot.key)] = slot;
  }
}

void PlaneGrid::insert(const Eigen::Vector3d& p) {
  const Eigen::Vector3d cell = floor_of(p / side_);
  const std::uint64_t key = key_of(cell);
  Slot& slot = slots_[slot_of(key)];
  const bool is_new = slot.voxel == none;
  if (is_new) {
    slot = {key, static_cast<std::uint32_t>(voxels_.size())};
    voxels_.emplace_back();
  }
  Voxel& v = voxels_[slot.voxel];
  if (is_new && 2 * voxels_.size() > slots_.size()) grow();
  if (v.n >= most) return;
  // About the voxel's corner, so that squares stay small.
  const Eigen::Vector3d d = p - side_ * cell;
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
  const Eigen::Vector3d cell = floor_of(p / side_);
  const Slot& slot = slots_[slot_of(key_of(cell))];
  if (slot.voxel == none) return nullptr;
  Voxel& v = voxels_[slot.voxel];
  if (v.n < fewest) return nullptr;
  if (v.n >= refit * v.fitted_n) fit(v, side_ * cell);
  return v.planar ? &v.plane : nullptr;
}

}  // namespace kilvo::lab
