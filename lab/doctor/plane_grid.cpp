#include "lab/doctor/plane_grid.hpp"

#include <algorithm>
#include <array>

#include "kilvo/math/decompositions.hpp"

namespace kilvo::lab {
namespace {

constexpr double fewest_points = 12;  // points of a plane
constexpr double refit = 1.25;        // times as many points as at the last fit
constexpr double flat = 0.08;         // of the middle to the smallest eigenvalue
constexpr double most = 20000;        // points of a voxel

constexpr std::size_t first_slots = 1024;

// The voxel that a point lies in.
struct Cell {
  Eigen::Vector3d at;  // coordinates in voxels
  std::uint64_t key = 0;
};

inline Cell cell_of(const Eigen::Vector3d& p, double side) {
  Cell cell;
  for (int i = 0; i < 3; ++i) {
    // floor() without a call
    const double x = p[i] / side;
    auto down = static_cast<std::int64_t>(x);
    down -= static_cast<double>(down) > x ? 1 : 0;
    cell.at[i] = static_cast<double>(down);
    cell.key = cell.key << 21 | (static_cast<std::uint64_t>(down + (1 << 20)) & ((1 << 21) - 1));
  }
  return cell;
}

inline std::uint64_t home_of(std::uint64_t key) { return key * 0x9E3779B97F4A7C15ULL >> 32; }

}  // namespace

PlaneGrid::PlaneGrid(double side) : side_(side), slots_(first_slots) {}

// Where the voxel of this key is, or would be; it is known not to be between its home and `from`.
std::size_t PlaneGrid::slot_of(std::uint64_t key, std::size_t from) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t i = from & mask;
  while (slots_[i].voxel != none && slots_[i].key != key) i = (i + 1) & mask;
  return i;
}

void PlaneGrid::grow() {
  std::vector<Slot> old(2 * slots_.size());
  old.swap(slots_);
  for (const Slot& slot : old) {
    if (slot.voxel != none) slots_[slot_of(slot.key, home_of(slot.key))] = slot;
  }
}

PlaneGrid::Voxel& PlaneGrid::voxel_of(std::uint64_t key, std::size_t from) {
  Slot& slot = slots_[slot_of(key, from)];
  if (slot.voxel != none) return voxels_[slot.voxel];
  slot = {key, static_cast<std::uint32_t>(voxels_.size())};
  Voxel& voxel = voxels_.emplace_back();
  if (2 * voxels_.size() > slots_.size()) grow();
  return voxel;
}

void PlaneGrid::insert(std::span<const Eigen::Vector3d> points) {
  // So many wait for memory at once.
  constexpr std::size_t together = 16;
  std::array<Cell, together> cells;
  std::array<std::size_t, together> at;
  for (std::size_t first = 0; first < points.size(); first += together) {
    const auto some = points.subspan(first, std::min(together, points.size() - first));
    for (std::size_t i = 0; i < some.size(); ++i) {
      cells[i] = cell_of(some[i], side_);
      __builtin_prefetch(&slots_[home_of(cells[i].key) & (slots_.size() - 1)]);
    }
    for (std::size_t i = 0; i < some.size(); ++i) {
      at[i] = slot_of(cells[i].key, home_of(cells[i].key));
      const Slot& slot = slots_[at[i]];
      if (slot.voxel == none) continue;
      const char* const voxel = reinterpret_cast<const char*>(&voxels_[slot.voxel]);
      for (std::size_t line = 0; line < sizeof(Voxel); line += 64) __builtin_prefetch(voxel + line);
    }
    const std::size_t size = slots_.size();
    for (std::size_t i = 0; i < some.size(); ++i) {
      Voxel& v = voxel_of(cells[i].key, slots_.size() == size ? at[i] : home_of(cells[i].key));
      if (v.n >= most) continue;
      // About the voxel's corner, so that squares stay small.
      const Eigen::Vector3d d = some[i] - side_ * cells[i].at;
      v.n += 1;
      v.sum += d;
      v.squares += d * d.transpose();
    }
  }
}

void PlaneGrid::fit(Voxel& v, const Eigen::Vector3d& corner) const {
  v.fitted_n = v.n;
  const Eigen::Vector3d mean = v.sum / v.n;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eig(Eigen::Matrix3d(v.squares / v.n - mean * mean.transpose()));
  const Eigen::Vector3d& e = eig.eigenvalues();
  const double spread = side_ * side_ / 200;
  v.planar = e[0] < flat * e[1] && e[1] > spread;
  v.plane = {eig.eigenvectors().col(0), corner + mean, std::max(e[0], 0.0)};
}

const GridPlane* PlaneGrid::find(const Eigen::Vector3d& p) {
  const Cell cell = cell_of(p, side_);
  const Slot& slot = slots_[slot_of(cell.key, home_of(cell.key))];
  if (slot.voxel == none) return nullptr;
  Voxel& v = voxels_[slot.voxel];
  if (v.n < fewest_points) return nullptr;
  if (v.n >= refit * v.fitted_n) fit(v, side_ * cell.at);
  return v.planar ? &v.plane : nullptr;
}

}  // namespace kilvo::lab
