// Planes that are not there any more: beams pass through them.
#include <algorithm>
#include <array>
#include <cmath>

#include "kilvo/map/voxel_map.hpp"

namespace kilvo {
namespace {

// So many beams of a sweep are followed. A plane that so many passed through since points were found on it is gone: by level of the octree,
// for beside an edge more beams of one sweep pass a large voxel's plane than a small one's.
constexpr std::size_t most_beams = 128;
constexpr std::array<float, 3> gone = {24, 10, 4};

}  // namespace

void VoxelMap::see_through(const Eigen::Vector3d& origin_W, std::span<const PointGroup> groups) {
  const std::size_t stride = std::max<std::size_t>(1, groups.size() / most_beams);
  for (std::size_t i = beams_of_++ % stride; i < groups.size(); i += stride) trace(origin_W, groups[i].mean);
}

// Looks at the leaves along the beam; a step is half of a leaf, so that few are missed.
void VoxelMap::trace(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const double length = (to - from).norm(), step = 0.5 * leaf_size();
  if (!(length < config_.radius)) return;
  const Eigen::Vector3d along = (step / length) * (to - from);
  Eigen::Vector3d x = from + 2 * along;
  Leaf last{};
  VoxelKey key = 0;
  std::uint32_t root = none, passed = none;
  bool first = true;
  for (double way = 2 * step; way + 2 * step < length; way += step, x += along) {
    const Leaf leaf = leaf_of(x);
    if (!first && leaf == last) continue;
    const VoxelKey here = root_key(leaf);
    if (first || here != key) root = roots_.find(here);
    first = false;
    key = here;
    last = leaf;
    if (root != none && is_passed(root, leaf, from, to, passed)) return;
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
    if (node.children == none) return false;
    const std::uint32_t child = children_[node.children][octant(leaf, level)];
    if (child == none) return false;
    path[static_cast<std::size_t>(level) + 1] = child;
    if (plane < 0 && nodes_[child].is_plane) plane = level + 1;
  }
  if (plane < 0) return false;
  const std::uint32_t index = path[static_cast<std::size_t>(plane)];
  Node& node = nodes_[index];
  // The beam begins clearly on one side, ends clearly on the other, and meets the plane within this leaf.
  const double before = node.plane.distance(from), behind = node.plane.distance(to), clear = leaf_size();
  if (index == last || before * behind > 0 || std::min(std::abs(before), std::abs(behind)) < clear) return false;
  if (leaf_of(from + before / (before - behind) * (to - from)) != leaf) return false;
  last = index;
  if (++node.against < gone[static_cast<std::size_t>(plane)]) return false;
  forget_plane(path, plane, root_centre(leaf));
  return true;
}

// The voxels above lose its points as well: what they hold is what their other children hold.
void VoxelMap::forget_plane(const Path& path, int level, const Eigen::Vector3d& origin) {
  Node& gone_one = nodes_[path[static_cast<std::size_t>(level)]];
  free_children(gone_one);
  gone_one = Node{};
  for (int above = level - 1; above >= 0; --above) {
    Node& node = nodes_[path[static_cast<std::size_t>(above)]];
    node.moments = Moments();
    for (const std::uint32_t child : children_[node.children]) {
      if (child != none) node.moments += nodes_[child].moments;
    }
    node.fitted_count = 0;
    refit_if_due(node, origin);
  }
}

}  // namespace kilvo
