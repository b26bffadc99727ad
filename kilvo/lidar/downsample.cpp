#include "kilvo/lidar/downsample.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>

#include "kilvo/map/voxel_index.hpp"

namespace kilvo {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Long4 = std::int64_t __attribute__((vector_size(32)));

// Sums around the first point of the cell, so that floats lose nothing. One line of the cache.
struct alignas(64) Cell {
  Float4 first_point{};    // x y z and anything
  Float4 sum_and_count{};  // x y z and how many
  Float4 outer_a{};        // xx xy xz yy
  Float4 outer_b{};        // yz zz and nothing of use

  Eigen::Vector3f first() const { return {first_point[0], first_point[1], first_point[2]}; }
  Eigen::Vector3f sum() const { return {sum_and_count[0], sum_and_count[1], sum_and_count[2]}; }
  float count() const { return sum_and_count[3]; }
};
static_assert(sizeof(Cell) == 64);

PointCluster cluster_of(const Cell& c) {
  PointCluster out;
  const Eigen::Vector3f sum = c.sum(), m = sum / c.count();
  out.mean = c.first() + m;
  out.count = c.count();
  out.scatter << c.outer_a[0] - sum.x() * m.x(), c.outer_a[1] - sum.x() * m.y(), c.outer_a[2] - sum.x() * m.z(),
      c.outer_a[3] - sum.y() * m.y(), c.outer_b[0] - sum.y() * m.z(), c.outer_b[1] - sum.z() * m.z();
  return out;
}

// A hash table for one sweep. It is a quarter full where cells hold a few points each, as they do, and half full at most.
class CellTable {
 public:
  explicit CellTable(std::size_t points) {
    slots_.assign(std::bit_ceil(std::clamp<std::size_t>(points / 2, 1024, 1 << 16)), empty);
    mask_ = slots_.size() - 1;
    cells_.reserve(points / 4);
    keys_.reserve(points / 4);
  }

  // Where the cell is; a new one begins at p (x y z and anything).
  [[gnu::always_inline]] inline Cell& at(VoxelKey key, const Float4& p) {
    for (std::size_t i = home(key);; i = (i + 1) & mask_) {
      const std::uint32_t slot = slots_[i];
      if (slot == empty) [[unlikely]]
        return begin_cell(i, key, p);
      if (keys_[slot] == key) [[likely]]
        return cells_[slot];
    }
  }

  // The cell beyond the upper face along this axis, if it has points.
  std::optional<std::uint32_t> above(std::size_t cell, int axis) const {
    const VoxelKey key = keys_[cell], one = VoxelKey{1} << (key_bits * axis), field = (one << key_bits) - one;
    const VoxelKey beside = (key & ~field) | ((key + one) & field);
    for (std::size_t i = home(beside); slots_[i] != empty; i = (i + 1) & mask_) {
      if (keys_[slots_[i]] == beside) return slots_[i];
    }
    return std::nullopt;
  }

  std::vector<Cell>& cells() { return cells_; }
  const std::vector<Cell>& cells() const { return cells_; }
  VoxelKey key_of(std::size_t cell) const { return keys_[cell]; }

 private:
  static constexpr std::uint32_t empty = no_index;
  std::size_t home(VoxelKey key) const { return (key * 0x9E3779B97F4A7C15ULL) >> 32 & mask_; }
  // By value: an address would keep the point in memory for all the others.
  [[gnu::noinline]] Cell& begin_cell(std::size_t slot, VoxelKey key, Float4 p) {
    slots_[slot] = static_cast<std::uint32_t>(cells_.size());
    cells_.emplace_back().first_point = p;
    keys_.push_back(key);
    if (2 * cells_.size() > slots_.size()) grow();
    return cells_.back();
  }
  void grow() {
    slots_.assign(2 * slots_.size(), empty);
    mask_ = slots_.size() - 1;
    for (std::uint32_t k = 0; k < cells_.size(); ++k) {
      std::size_t i = home(keys_[k]);
      while (slots_[i] != empty) i = (i + 1) & mask_;
      slots_[i] = k;
    }
  }

  std::vector<std::uint32_t> slots_;
  std::vector<Cell> cells_;
  std::vector<VoxelKey> keys_;  // of the cells
  std::size_t mask_;
};

// Cells of the grid: x -> floor(R x + t), R and t in cells.
struct Grid {
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
};

// The mean of each cell from its lower corner on, in cells.
std::vector<Eigen::Vector3f> means_of(const CellTable& table, const Grid& grid) {
  std::vector<Eigen::Vector3f> means;
  means.reserve(table.cells().size());
  for (std::size_t i = 0; i < table.cells().size(); ++i) {
    const Cell& c = table.cells()[i];
    const Eigen::Vector3d w = grid.R * (c.first() + c.sum() / c.count()).cast<double>() + grid.t;
    const VoxelKey key = table.key_of(i);
    const auto low = [key](int axis) { return static_cast<double>(coordinate_of(key, axis)); };
    means.emplace_back((w - Eigen::Vector3d(low(0), low(1), low(2))).cast<float>());
  }
  return means;
}

// Of each cell the index of the cell that its points belong to: itself, or the fuller neighbour across a face, where both their means are
// within `reach` (in cells) of that face. A surface along a face is cut in two by its noise: the few points beyond would be a cluster of
// their own, far off the surface, and those that stayed would lean the other way.
std::vector<std::uint32_t> owners_of(const CellTable& table, const Grid& grid, float reach) {
  const std::vector<Cell>& cells = table.cells();
  const std::vector<Eigen::Vector3f> means = means_of(table, grid);
  std::vector<std::uint32_t> owner(cells.size());
  for (std::uint32_t i = 0; i < cells.size(); ++i) owner[i] = i;
  // Fuller, or first among equals: no two own each other.
  const auto offer = [&](std::uint32_t& to, std::uint32_t other) {
    const float count = cells[other].count(), best = cells[to].count();
    if (count > best || (count == best && other < to)) to = other;
  };
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      if (means[i][axis] < 1 - reach) continue;
      const auto other = table.above(i, axis);
      if (!other || means[*other][axis] > reach) continue;
      offer(owner[i], *other);
      offer(owner[*other], i);
    }
  }
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    while (owner[owner[i]] != owner[i]) owner[i] = owner[owner[i]];
  }
  return owner;
}

// The sums of `from`, moved to the first point of `to`.
void join(const Cell& from, Cell& to) {
  const Eigen::Vector3f d = from.first() - to.first(), sum = from.sum();
  const float count = from.count();
  const auto moved = [&](int i, int j) { return sum[i] * d[j] + d[i] * sum[j] + count * d[i] * d[j]; };
  to.outer_a += from.outer_a + Float4{moved(0, 0), moved(0, 1), moved(0, 2), moved(1, 1)};
  to.outer_b += from.outer_b + Float4{moved(1, 2), moved(2, 2), 0, 0};
  const Eigen::Vector3f shift = count * d;
  to.sum_and_count += from.sum_and_count + Float4{shift.x(), shift.y(), shift.z(), 0};
}

[[gnu::always_inline]] inline void add(const Float4& p, Cell& c) {
  constexpr Int4 point = {-1, -1, -1, 0}, one = {0, 0, 0, std::bit_cast<int>(1.0F)};
  const Float4 d = std::bit_cast<Float4>((std::bit_cast<Int4>(p - c.first_point) & point) | one);
  c.sum_and_count += d;
  c.outer_a += Float4{d[0], d[0], d[0], d[1]} * Float4{d[0], d[1], d[2], d[1]};
  c.outer_b += Float4{d[1], d[2], d[1], d[2]} * Float4{d[2], d[2], d[2], d[2]};
}

// floor() of what is below 2^31.
[[gnu::always_inline]] inline void floor_of(const Double4& x, Long4& out) {
  const Int4 down = __builtin_convertvector(x, Int4);
  const Double4 back = __builtin_convertvector(down, Double4);
  out = __builtin_convertvector(down, Long4) + (x < back);
}

constexpr std::size_t block = 256;  // points

// The keys of four points at a time; `count` is a multiple of four.
KILVO_WIDE void keys_of(const float* points, std::size_t count, const Grid& grid, VoxelKey* keys) {
  constexpr std::int64_t low_bits = (1LL << key_bits) - 1;
  const Eigen::Matrix3d& R = grid.R;
  for (std::size_t i = 0; i < count; i += 4, points += 16) {
    Float4 a, b, c, d;
    std::memcpy(&a, points, sizeof(a));
    std::memcpy(&b, points + 4, sizeof(b));
    std::memcpy(&c, points + 8, sizeof(c));
    std::memcpy(&d, points + 12, sizeof(d));
    const Float4 ab = Float4{a[0], b[0], a[1], b[1]}, cd = Float4{c[0], d[0], c[1], d[1]};
    const Float4 ab_z = Float4{a[2], b[2], a[3], b[3]}, cd_z = Float4{c[2], d[2], c[3], d[3]};
    const Double4 x = __builtin_convertvector(Float4{ab[0], ab[1], cd[0], cd[1]}, Double4);
    const Double4 y = __builtin_convertvector(Float4{ab[2], ab[3], cd[2], cd[3]}, Double4);
    const Double4 z = __builtin_convertvector(Float4{ab_z[0], ab_z[1], cd_z[0], cd_z[1]}, Double4);
    Long4 key{};
    for (int k = 0; k < 3; ++k) {
      Long4 cell;
      floor_of(R(k, 0) * x + (R(k, 1) * y + R(k, 2) * z) + grid.t[k], cell);
      key |= (cell & low_bits) << (key_bits * k);
    }
    for (std::size_t j = 0; j < 4; ++j) keys[i + j] = static_cast<VoxelKey>(key[j]);
  }
}

// The points of a block into their cells.
KILVO_WIDE void add_all(const float* points, const VoxelKey* keys, std::size_t count, CellTable& table) {
  for (std::size_t i = 0; i < count; ++i) {
    Float4 p;
    std::memcpy(&p, points + 4 * i, sizeof(p));
    add(p, table.at(keys[i], p));
  }
}

// All points into their cells.
void gather(std::span<const PointXYZI> points, const Grid& grid, CellTable& table) {
  std::array<VoxelKey, block> keys;
  std::array<Float4, 4> last{};  // of a block, which need not be four
  for (std::size_t first = 0; first < points.size(); first += block) {
    const std::size_t count = std::min(block, points.size() - first), whole = count & ~std::size_t{3};
    const float* at = points[first].data();
    keys_of(at, whole, grid, keys.data());
    if (whole < count) {
      std::memcpy(last.data(), at + 4 * whole, (count - whole) * sizeof(Float4));
      keys_of(reinterpret_cast<const float*>(last.data()), 4, grid, keys.data() + whole);
    }
    add_all(at, keys.data(), count, table);
  }
}

}  // namespace

std::vector<PointCluster> downsample(std::span<const PointXYZI> points, const SE3& T_WI, double cell, double reach) {
  CellTable table(points.size());
  const Grid grid{T_WI.R.matrix() / cell, T_WI.p / cell};
  gather(points, grid, table);
  std::vector<Cell>& cells = table.cells();
  const std::vector<std::uint32_t> owner = owners_of(table, grid, static_cast<float>(std::min(reach / cell, 0.25)));
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
