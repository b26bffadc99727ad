#include "kilvo/lidar/downsample.hpp"

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

// A hash table for one sweep: half full at most, 32-bit slots.
class CellTable {
 public:
  explicit CellTable(std::size_t points) {
    std::size_t capacity = 1024;
    while (capacity < 2 * points) capacity *= 2;
    slots_.assign(capacity, empty);
    mask_ = capacity - 1;
  }

  Cell& cell_of(VoxelKey key, const Eigen::Vector3f& p) {
    for (std::size_t i = (key * 0x9E3779B97F4A7C15ULL) >> 32 & mask_;; i = (i + 1) & mask_) {
      if (slots_[i] == empty) {
        slots_[i] = static_cast<std::uint32_t>(cells_.size());
        return cells_.emplace_back(Cell{key, p, Eigen::Vector3f::Zero(), 0, Eigen::Matrix<float, 6, 1>::Zero()});
      }
      if (cells_[slots_[i]].key == key) return cells_[slots_[i]];
    }
  }

  const std::vector<Cell>& cells() const { return cells_; }

 private:
  static constexpr std::uint32_t empty = 0xffffffff;
  std::vector<std::uint32_t> slots_;
  std::vector<Cell> cells_;
  std::size_t mask_;
};

}  // namespace

std::vector<PointCluster> downsample(std::span<const PointXYZI> points, const SE3& T_WI, double cell) {
  CellTable table(points.size());
  const Eigen::Matrix3d R = T_WI.R.matrix() / cell;
  const Eigen::Vector3d t = T_WI.p / cell;
  for (const PointXYZI& point : points) {
    const Eigen::Vector3f p = point.head<3>();
    const Eigen::Vector3d w = R * p.cast<double>() + t;
    Cell& c = table.cell_of(pack_key(fast_floor(w.x()), fast_floor(w.y()), fast_floor(w.z())), p);
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
  std::vector<PointCluster> out;
  out.reserve(table.cells().size());
  for (const Cell& c : table.cells()) out.push_back(cluster_of(c));
  return out;
}

}  // namespace kilvo
