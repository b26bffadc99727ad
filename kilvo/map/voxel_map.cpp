#include "kilvo/map/voxel_map.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

// A plane is fitted again when its points have grown by this factor.
constexpr double refit_growth = 1.25;
// What lies within this many standard deviations of a plane may lie on it.
constexpr double on_plane_sigmas = 4.0;
// So many points wait for memory at once; what they wait for must fit the innermost cache.
constexpr std::size_t together = 32;

bool is_within(const Plane& plane, const Eigen::Vector3d& x, double variance) {
  const double d = plane.distance(x);
  return d * d < on_plane_sigmas * on_plane_sigmas * (variance + plane.variance_at(x));
}

Eigen::Vector3d centre_of(VoxelKey key, double size) {
  const auto coordinate = [key](int axis) { return static_cast<double>(coordinate_of(key, axis)) + 0.5; };
  return size * Eigen::Vector3d(coordinate(0), coordinate(1), coordinate(2));
}

}  // namespace

VoxelMap::VoxelMap(const MapConfig& config)
    : config_(config),
      leaves_per_metre_((1 << depth) * (1.0 / config.voxel_size)),
      passed_in_(direction_cells * direction_cells * direction_cells) {}

Eigen::Vector3d VoxelMap::root_centre(const Leaf& l) const {
  const auto coordinate = [this](std::int64_t v) { return (static_cast<double>(v >> depth) + 0.5) * config_.voxel_size; };
  return {coordinate(l[0]), coordinate(l[1]), coordinate(l[2])};
}

const Plane* VoxelMap::plane_at(const Eigen::Vector3d& x) const {
  const Plane* found = nullptr;
  visit_planes(x, [&found](const Match& m) {
    found = m.plane;
    return true;
  });
  return found;
}

// Walks with up to `together` points from their root voxels down, all of them one step at a time, and asks for what the next step will
// read. stop(i, index) ends the walk of point i at the node. Inlined by order: g++ 12 drops the call of a function that only prefetches.
template <std::size_t first_line, class Stop>
[[gnu::always_inline]] inline void VoxelMap::walk_in_step(std::span<const Leaf> leaves, Stop&& stop) const {
  std::array<std::uint32_t, together> at;
  const auto prefetch_node = [this](std::uint32_t index) __attribute__((always_inline)) {
    const char* node = reinterpret_cast<const char*>(&nodes_[index]);
    __builtin_prefetch(node + 64 * first_line);
    __builtin_prefetch(node + 64 * (first_line + 1));
  };
  for (const Leaf& leaf : leaves) roots_.prefetch(root_key(leaf));
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    at[i] = roots_.find(root_key(leaves[i]));
    if (at[i] != no_index) prefetch_node(at[i]);
  }
  for (int level = 0;; ++level) {
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      if (at[i] == no_index) continue;
      const std::uint32_t table = nodes_[at[i]].children;
      if (stop(i, at[i]) || table == no_index) {
        at[i] = no_index;
      } else {
        __builtin_prefetch(&children_[table]);
      }
    }
    if (level == depth) return;
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      if (at[i] == no_index) continue;
      at[i] = children_[nodes_[at[i]].children][octant(leaves[i], level)];
      if (at[i] != no_index) prefetch_node(at[i]);
    }
  }
}

void VoxelMap::first_planes(std::span<const Eigen::Vector3d> points, std::span<Match> out) const {
  std::array<Leaf, together> leaves;
  for (std::size_t first = 0; first < points.size(); first += together) {
    const std::size_t count = std::min(together, points.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      leaves[i] = leaf_of(points[first + i]);
      out[first + i] = {};
    }
    walk_in_step<0>({leaves.data(), count}, [&](std::size_t i, std::uint32_t index) {
      const Node& node = nodes_[index];
      if (node.is_plane) out[first + i] = {&node.plane, index, node.epoch, sweep_ - node.born, node.one_sided};
      return node.is_plane;
    });
  }
}

bool VoxelMap::explains(const Plane& plane, const PointGroup& group) {
  const Eigen::Vector3d n = plane.normal.cast<double>();
  return is_within(plane, group.mean, n.dot(group.noise * n) / group.count + static_cast<double>(plane.roughness_variance));
}

// A plane keeps its side: that of the first fit that is certain of it.
void VoxelMap::refit_if_due(Node& node, const Eigen::Vector3d& origin, const std::optional<Eigen::Vector3d>& seen_from) {
  const double n = node.moments.count();
  if (n < config_.min_points || n < refit_growth * static_cast<double>(node.fitted_count)) return;
  node.fitted_count = static_cast<float>(n);
  auto plane = fit_plane(node.moments, origin, config_.min_points, config_.max_roughness);
  if (plane) {
    const bool had_side = node.is_plane && node.one_sided;
    node.one_sided = had_side || (seen_from && !is_within(*plane, *seen_from, 0));
    if (had_side ? plane->normal.dot(node.plane.normal) < 0 : seen_from && plane->distance(*seen_from) < 0) plane->normal = -plane->normal;
    node.plane = *plane;
  }
  node.is_plane = plane.has_value();
}

void VoxelMap::insert(std::span<const PointGroup> groups, std::uint32_t epoch, const std::optional<Eigen::Vector3d>& seen_from) {
  const double farthest = leaf_size() * static_cast<double>(std::int64_t{1} << (key_bits - 1));  // m: beyond it the key has no bits
  const auto usable = [&](const PointGroup& g) { return g.count > 0 && (g.mean.array().abs() < farthest).all(); };
  std::array<const PointGroup*, together> next;
  std::array<std::uint32_t, together> roots;
  std::array<Leaf, together> leaves;
  for (std::size_t first = 0; first < groups.size(); first += together) {
    std::size_t count = 0;
    for (const PointGroup& g : groups.subspan(first, std::min(together, groups.size() - first))) {
      if (!usable(g)) continue;
      leaves[count] = leaf_of(g.mean);
      next[count++] = &g;
    }
    // Of this walk only the root is kept; the rest is there to have the nodes at hand.
    std::fill_n(roots.begin(), count, no_index);
    walk_in_step<1>({leaves.data(), count}, [&](std::size_t i, std::uint32_t index) {
      if (roots[i] == no_index) roots[i] = index;
      return is_settled(nodes_[index]);
    });
    for (std::size_t i = 0; i < count; ++i) insert_one(*next[i], leaves[i], roots[i], {epoch, seen_from});
  }
}

void VoxelMap::insert_one(const PointGroup& group, const Leaf& leaf, std::uint32_t root, const Insertion& insertion) {
  const auto new_node = [this, epoch = insertion.epoch] {
    const std::uint32_t i = nodes_.take();
    nodes_[i] = Node{};
    nodes_[i].epoch = epoch;
    return i;
  };
  const VoxelKey key = root_key(leaf);
  // A root that was not there before may have come with the group before this one.
  std::uint32_t index = root == no_index ? roots_.find(key) : root;
  if (index == no_index) {
    index = new_node();
    roots_.insert(key, index);
    keys_.push_back(key);
  }
  const Eigen::Vector3d origin = root_centre(leaf);
  bool above_is_plane = false;
  for (int level = 0;; ++level) {
    Node& node = nodes_[index];
    const bool settled = is_settled(node);
    if (node.against > 0 && node.is_plane && explains(node.plane, group)) node.against = 0;
    if (node.moments.count() == 0) node.epoch = insertion.epoch, node.born = sweep_;
    if (settled && explains(node.plane, group)) return;
    if (!settled) {
      node.moments.add(group, origin);
      // Below a plane the moments are kept, for the day it is none any more, but nothing is fitted.
      if (!above_is_plane) refit_if_due(node, origin, insertion.seen_from);
    }
    if (level == depth) return;
    above_is_plane = above_is_plane || (node.is_plane && !settled);
    if (node.children == no_index) {
      const std::uint32_t table = children_.take();
      children_[table].fill(no_index);
      node.children = table;
    }
    std::uint32_t& child = children_[node.children][octant(leaf, level)];
    if (child == no_index) child = new_node();
    index = child;
  }
}

void VoxelMap::free_children(Node& node) {
  if (node.children == no_index) return;
  for (const std::uint32_t child : children_[node.children]) {
    if (child != no_index) free_tree(child);
  }
  children_.free.push_back(node.children);
  node.children = no_index;
}

void VoxelMap::free_tree(std::uint32_t index) {
  free_children(nodes_[index]);
  nodes_.free.push_back(index);
}

void VoxelMap::forget(const Eigen::Vector3d& centre) {
  const bool too_many = node_count() > static_cast<std::size_t>(config_.max_nodes);
  if (!too_many && (centre - last_forget_).norm() < 0.05 * config_.radius) return;
  last_forget_ = centre;
  const auto squared_distance = [&](VoxelKey key) { return (centre_of(key, config_.voxel_size) - centre).squaredNorm(); };
  const auto drop_beyond = [&](double radius) {
    std::erase_if(keys_, [&](VoxelKey key) {
      if (squared_distance(key) <= radius * radius) return false;
      free_tree(roots_.find(key));
      roots_.erase(key);
      return true;
    });
  };
  drop_beyond(config_.radius);
  if (node_count() > static_cast<std::size_t>(config_.max_nodes)) {
    // Keep the nearest four fifths of the roots, so that this is rare.
    std::vector<double> distances(keys_.size());
    std::transform(keys_.begin(), keys_.end(), distances.begin(), squared_distance);
    const auto cut = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() * 4 / 5);
    std::nth_element(distances.begin(), cut, distances.end());
    drop_beyond(std::sqrt(*cut));
  }
}

std::size_t VoxelMap::memory_bytes() const {
  return nodes_.blocks.size() * block_size * sizeof(Node) + children_.blocks.size() * block_size * sizeof(Children) +
         roots_.capacity() * 16 + keys_.capacity() * sizeof(VoxelKey);
}

}  // namespace kilvo
