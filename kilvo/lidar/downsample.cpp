#include "kilvo/lidar/downsample.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "kilvo/map/voxel_index.hpp"

namespace kilvo {
namespace {

// Sums around the first point of the cell, so that floats lose nothing.
struct Cell {
  VoxelKey key;
  Eigen::Vector3f first, sum;
  float count;
  Eigen::Matrix<float, 6, 1> outer;
};

PointCluster cluster_of(const Cell& c) {
  PointCluster out;
  const Eigen::Vector3f m = c.sum / c.count;
  out.mean = c.first + m;
  out.count = c.count;
  out.scatter << c.outer[0] - c.sum.x() * m.x(), c.outer[1] - c.sum.x() * m.y(), c.outer[2] - c.sum.x() * m.z(),
      c.outer[3] - c.sum.y() * m.y(), c.outer[4] - c.sum.y() * m.z(), c.outer[5] - c.sum.z() * m.z();
  return out;
}

// A hash table for one sweep: half full at most, 32-bit slots; no larger than the cells need, so that it stays in the inner caches.
class CellTable {
 public:
  explicit CellTable(std::size_t points) {
    slots_.assign(4096, empty);
    mask_ = slots_.size() - 1;
    cells_.reserve(points / 2);
  }

  void prefetch(VoxelKey key) const { __builtin_prefetch(&slots_[home(key)]); }

  Cell& cell_of(VoxelKey key, const Eigen::Vector3f& p) {
    for (std::size_t i = home(key);; i = (i + 1) & mask_) {
      if (slots_[i] == empty) {
        slots_[i] = static_cast<std::uint32_t>(cells_.size());
        cells_.emplace_back(Cell{key, p, Eigen::Vector3f::Zero(), 0, Eigen::Matrix<float, 6, 1>::Zero()});
        if (2 * cells_.size() > slots_.size()) grow();
        return cells_.back();
      }
      if (cells_[slots_[i]].key == key) return cells_[slots_[i]];
    }
  }

  std::optional<std::uint32_t> find(VoxelKey key) const {
    for (std::size_t i = home(key); slots_[i] != empty; i = (i + 1) & mask_) {
      if (cells_[slots_[i]].key == key) return slots_[i];
    }
    return std::nullopt;
  }

  std::vector<Cell>& cells() { return cells_; }
  const std::vector<Cell>& cells() const { return cells_; }

 private:
  static constexpr std::uint32_t empty = 0xffffffff;
  std::size_t home(VoxelKey key) const { return (key * 0x9E3779B97F4A7C15ULL) >> 32 & mask_; }
  void grow() {
    slots_.assign(2 * slots_.size(), empty);
    mask_ = slots_.size() - 1;
    for (std::uint32_t k = 0; k < cells_.size(); ++k) {
      std::size_t i = home(cells_[k].key);
      while (slots_[i] != empty) i = (i + 1) & mask_;
      slots_[i] = k;
    }
  }

  std::vector<std::uint32_t> slots_;
  std::vector<Cell> cells_;
  std::size_t mask_;
};

// The mean of each cell, in cells, in the world.
std::vector<Eigen::Vector3d> means_of(const std::vector<Cell>& cells, const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  std::vector<Eigen::Vector3d> means;
  means.reserve(cells.size());
  for (const Cell& c : cells) means.emplace_back(R * (c.first + c.sum / c.count).cast<double>() + t);
  return means;
}

// Of each cell the index of the cell that its points belong to: itself, or the fuller neighbour across a face, where both their means are
// within `reach` (in cells) of that face. A surface along a face is cut in two by its noise: the few points beyond would be a cluster of
// their own, far off the surface, and those that stayed would lean the other way.
std::vector<std::uint32_t> owners_of(const CellTable& table, const Eigen::Matrix3d& R, const Eigen::Vector3d& t, double reach) {
  const std::vector<Cell>& cells = table.cells();
  const std::vector<Eigen::Vector3d> means = means_of(cells, R, t);
  std::vector<std::uint32_t> owner(cells.size());
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    owner[i] = i;
    const Eigen::Vector3d& w = means[i];
    const std::array<std::int64_t, 3> at = {fast_floor(w.x()), fast_floor(w.y()), fast_floor(w.z())};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int k = static_cast<int>(axis);
      const double into = w[k] - static_cast<double>(at[axis]);
      if (into > reach && into < 1 - reach) continue;
      const std::int64_t side = into > 0.5 ? 1 : -1;
      auto beside = at;
      beside[axis] += side;
      const auto other = table.find(pack_key(beside[0], beside[1], beside[2]));
      if (!other) continue;
      const double face = static_cast<double>(side > 0 ? at[axis] + 1 : at[axis]);
      if (std::abs(means[*other][k] - face) > reach) continue;
      const float best = cells[owner[i]].count;
      // Fuller, or first among equals: no two own each other.
      if (cells[*other].count > best || (cells[*other].count == best && *other < owner[i])) owner[i] = *other;
    }
  }
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    while (owner[owner[i]] != owner[i]) owner[i] = owner[owner[i]];
  }
  return owner;
}

// The sums of `from`, moved to the first point of `to`.
void join(const Cell& from, Cell& to) {
  const Eigen::Vector3f d = from.first - to.first;
  const auto moved = [&](int i, int j) { return from.sum[i] * d[j] + d[i] * from.sum[j] + from.count * d[i] * d[j]; };
  Eigen::Matrix<float, 6, 1> shift;
  shift << moved(0, 0), moved(0, 1), moved(0, 2), moved(1, 1), moved(1, 2), moved(2, 2);
  to.outer += from.outer + shift;
  to.sum += from.sum + from.count * d;
  to.count += from.count;
}

void add(const Eigen::Vector3f& p, Cell& c) {
  const Eigen::Vector3f d = p - c.first;
  c.count += 1;
  c.sum += d;
  c.outer[0] += d.x() * d.x();
  c.outer[1] += d.x() * d.y();
  c.outer[2] += d.x() * d.z();
  c.outer[3] += d.y() * d.y();
  c.outer[4] += d.y() * d.z();
  c.outer[5] += d.z() * d.z();
}

}  // namespace

std::vector<PointCluster> downsample(std::span<const PointXYZI> points, const SE3& T_WI, double cell, double reach) {
  CellTable table(points.size());
  const Eigen::Matrix3d R = T_WI.R.matrix() / cell;
  const Eigen::Vector3d t = T_WI.p / cell;
  // So many points wait for the table at once.
  constexpr std::size_t together = 32;
  std::array<VoxelKey, together> keys;
  for (std::size_t first = 0; first < points.size(); first += together) {
    const auto next = points.subspan(first, std::min(together, points.size() - first));
    for (std::size_t i = 0; i < next.size(); ++i) {
      const Eigen::Vector3d w = R * next[i].head<3>().cast<double>() + t;
      keys[i] = pack_key(fast_floor(w.x()), fast_floor(w.y()), fast_floor(w.z()));
      table.prefetch(keys[i]);
    }
    for (std::size_t i = 0; i < next.size(); ++i) add(next[i].head<3>(), table.cell_of(keys[i], next[i].head<3>()));
  }
  std::vector<Cell>& cells = table.cells();
  const std::vector<std::uint32_t> owner = owners_of(table, R, t, std::min(reach / cell, 0.25));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (owner[i] != i) join(cells[i], cells[owner[i]]);
  }
  std::vector<PointCluster> out;
  out.reserve(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (owner[i] == i) out.push_back(cluster_of(cells[i]));
  }
  return out;
}

}  // namespace kilvo
