// Planes that are not there any more: beams pass through them.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kilvo/map/voxel_map.hpp"

namespace kilvo {
namespace {

// Beams of a sweep are followed, others each time; and more of them in directions in which one of the last few sweeps passed through a
// plane: what has left leaves more than one. All together not further than so many metres, of which the first kind has a third.
constexpr std::size_t most_beams = 256, most_more = 512;
constexpr double most_way = 2500;
constexpr std::uint32_t few = 6, long_ago = 50;
// A plane that beams of so many sweeps passed through since points were found on it is gone.
constexpr std::uint8_t gone = 5;

// How far along the beam it is from x until it leaves the cube of this size that is the one `at` of its grid and holds x.
double way_out(const Eigen::Vector3d& x, const Eigen::Vector3d& inverse_direction, const std::array<std::int64_t, 3>& at, double size) {
  double way = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double low = size * static_cast<double>(at[static_cast<std::size_t>(i)]), into = inverse_direction[i];
    const double face = into > 0 ? low + size : low;
    if (std::abs(into) < std::numeric_limits<double>::infinity()) way = std::min(way, std::max(0.0, (face - x[i]) * into));
  }
  return way;
}

// The beam begins clearly on one side and ends clearly on the other.
bool passes(const Plane& plane, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double clear) {
  const double before = plane.distance(from), behind = plane.distance(to);
  return before * behind < 0 && std::min(std::abs(before), std::abs(behind)) > clear;
}

}  // namespace

void VoxelMap::see_through(const Eigen::Vector3d& origin_W, std::span<const Eigen::Vector3d> ends) {
  ++sweep_;
  // Two planes in a minute that were gone soon after their first points are no chance; else it is less likely the longer there were none.
  moving_share_ = gone_soon_ > 1 ? 1 : moving_share_ * std::exp(-1.0 / long_ago);
  gone_soon_ *= std::exp(-0.1 / long_ago);
  if (ends.empty()) return;
  const std::size_t count = ends.size(), stride = std::max<std::size_t>(1, count / most_beams);
  const std::size_t first =
      7919 * static_cast<std::size_t>(sweep_) % count;  // a different one each time: with too long beams each has its turn
  double left = most_way;
  const auto follow = [&](const Eigen::Vector3d& to) {
    trace(origin_W, to);
    left -= (to - origin_W).norm();
  };
  for (std::size_t i = 0; i < count && left > 2 * most_way / 3; i += stride) follow(ends[(first + i) % count]);
  if (sweep_ - passed_last_ >= few) return;
  std::size_t more = 0;
  for (std::size_t i = 0; i < count && left > 0 && more < most_more; ++i) {
    const Eigen::Vector3d& to = ends[(first + i) % count];
    if (sweep_ - passed_in_[direction_cell(to - origin_W)] >= few) continue;
    follow(to);
    ++more;
  }
}

std::size_t VoxelMap::direction_cell(const Eigen::Vector3d& way) {
  const Eigen::Vector3d d = (0.5 * direction_cells * (1 - 1e-9)) * (way.normalized().array() + 1);
  const auto at = [&d](int i) { return static_cast<std::size_t>(d[i]); };
  return at(0) + direction_cells * (at(1) + direction_cells * at(2));
}

// From one root voxel to the next, and from leaf to leaf only within those that hold more than a plane that the beam does not cross.
void VoxelMap::trace(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const double length = (to - from).norm(), clear = leaf_size();
  if (!(length < config_.radius) || length < 2 * clear) return;
  const Eigen::Vector3d direction = (to - from) / length, inverse_direction = direction.cwiseInverse();
  constexpr double beyond = 1e-6;  // m: on the other side of a face
  std::uint32_t last = no_index;
  for (double way = clear; way < length - clear;) {
    const Eigen::Vector3d x = from + way * direction;
    const Leaf leaf = leaf_of(x);
    const std::uint32_t root = roots_.find(root_key(leaf));
    const bool empty = root == no_index || (nodes_[root].is_plane && !passes(nodes_[root].plane, from, to, clear));
    if (!empty && is_passed(root, leaf, from, to, last)) return;
    const Leaf in_grid = empty ? Leaf{leaf[0] >> depth, leaf[1] >> depth, leaf[2] >> depth} : leaf;
    way += beyond + way_out(x, inverse_direction, in_grid, empty ? config_.voxel_size : clear);
  }
}

// Counts a beam against the plane that it passes through in this leaf; true when that made the plane disappear.
bool VoxelMap::is_passed(std::uint32_t root, const Leaf& leaf, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                         std::uint32_t& last) {
  Path path{root};
  int plane = nodes_[root].is_plane ? 0 : -1, level = 0;
  // Only where points were: a plane need not fill its voxel.
  for (; level < depth; ++level) {
    const Node& node = nodes_[path[static_cast<std::size_t>(level)]];
    if (node.children == no_index) return false;
    const std::uint32_t child = children_[node.children][octant(leaf, level)];
    if (child == no_index) return false;
    path[static_cast<std::size_t>(level) + 1] = child;
    if (plane < 0 && nodes_[child].is_plane) plane = level + 1;
  }
  if (plane < 0) return false;
  const std::uint32_t index = path[static_cast<std::size_t>(plane)];
  Node& node = nodes_[index];
  if (index == last || !passes(node.plane, from, to, leaf_size())) return false;
  // It meets the plane within this leaf.
  const double before = node.plane.distance(from), behind = node.plane.distance(to);
  if (leaf_of(from + before / (before - behind) * (to - from)) != leaf) return false;
  last = index;
  // Beside an edge many beams of one sweep pass a plane, and the next sweep finds it again: that is worth no more beams.
  if (node.passed_in == sweep_) return false;
  if (node.against > 0 || sweep_ - node.passed_in > long_ago) passed_last_ = passed_in_[direction_cell(to - from)] = sweep_;
  node.passed_in = sweep_;
  if (++node.against < gone) return false;
  forget_plane(path, plane, root_centre(leaf));
  return true;
}

// The voxels above lose its points as well: what they hold is what their other children hold.
void VoxelMap::forget_plane(const Path& path, int level, const Eigen::Vector3d& origin) {
  Node& gone_one = nodes_[path[static_cast<std::size_t>(level)]];
  if (sweep_ - gone_one.born < 4 * gone) gone_soon_ += 1;
  free_children(gone_one);
  gone_one = Node{};
  for (int above = level - 1; above >= 0; --above) {
    Node& node = nodes_[path[static_cast<std::size_t>(above)]];
    node.moments = Moments();
    for (const std::uint32_t child : children_[node.children]) {
      if (child != no_index) node.moments += nodes_[child].moments;
    }
    node.fitted_count = 0;
    refit_if_due(node, origin, {});
  }
}

}  // namespace kilvo
