#include "kilvo/map/voxel_map.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

constexpr int depth = 2;
// A plane is fitted again when its points have grown by this factor.
constexpr double refit_growth = 1.25;
// A settled plane explains a group whose mean lies within this many standard deviations.
constexpr double settled_sigmas = 4.0;

Eigen::Vector3d centre_of(VoxelKey key, double size) {
  const auto coordinate = [key](int shift) {
    auto v = static_cast<std::int64_t>((key >> shift) & ((1ULL << 21) - 1));
    if (v >= (1LL << 20)) v -= 1LL << 21;
    return static_cast<double>(v) + 0.5;
  };
  return size * Eigen::Vector3d(coordinate(0), coordinate(21), coordinate(42));
}

}  // namespace

template <class T>
std::uint32_t VoxelMap::Pool<T>::take() {
  if (!free.empty()) {
    const std::uint32_t i = free.back();
    free.pop_back();
    return i;
  }
  if (used == blocks.size() * block_size) blocks.push_back(std::make_unique<T[]>(block_size));
  return used++;
}

template <class T>
void VoxelMap::Pool<T>::give_back(std::uint32_t i) {
  free.push_back(i);
}

VoxelMap::VoxelMap(const MapConfig& config) : config_(config), inverse_size_(1.0 / config.voxel_size) {}

Eigen::Vector3d VoxelMap::root_centre(const Eigen::Vector3d& x) const {
  const auto coordinate = [this](double v) { return (static_cast<double>(fast_floor(v * inverse_size_)) + 0.5) * config_.voxel_size; };
  return {coordinate(x.x()), coordinate(x.y()), coordinate(x.z())};
}

Eigen::Vector3d VoxelMap::child_centre(const Eigen::Vector3d& centre, unsigned octant, double quarter) {
  return centre + quarter * Eigen::Vector3d(octant & 1u ? 1 : -1, octant & 2u ? 1 : -1, octant & 4u ? 1 : -1);
}

const Plane* VoxelMap::plane_at(const Eigen::Vector3d& x) const {
  const Plane* found = nullptr;
  visit_planes(x, [&found](const Match& m) {
    found = m.plane;
    return true;
  });
  return found;
}

bool VoxelMap::settled_and_explains(const Node& node, const PointGroup& group) const {
  if (!node.is_plane || node.moments.count() < config_.full_points) return false;
  const Eigen::Vector3d n = node.plane.normal.cast<double>();
  const double d = node.plane.distance(group.mean);
  const double variance =
      n.dot(group.noise * n) / group.count + static_cast<double>(node.plane.roughness_variance) + node.plane.variance_at(group.mean);
  return d * d < settled_sigmas * settled_sigmas * variance;
}

void VoxelMap::refit_if_due(Node& node, const Eigen::Vector3d& origin) {
  const double n = node.moments.count();
  if (n < config_.min_points || n < refit_growth * node.fitted_count) return;
  node.fitted_count = n;
  const auto plane = fit_plane(node.moments, origin, {config_.min_points, config_.max_roughness});
  node.is_plane = plane.has_value();
  if (plane) node.plane = *plane;
}

void VoxelMap::insert(std::span<const PointGroup> groups, std::uint32_t epoch) {
  for (const PointGroup& g : groups) {
    constexpr double farthest = 1e5;  // m; what is beyond is no place a robot walks to, and would leave the key's bits
    if (g.count > 0 && (g.mean.array().abs() < farthest).all()) insert_one(g, epoch);
  }
}

void VoxelMap::insert_one(const PointGroup& group, std::uint32_t epoch) {
  const VoxelKey key = root_key(group.mean);
  std::uint32_t index = roots_.find(key);
  const auto new_node = [this, epoch] {
    const std::uint32_t i = nodes_.take();
    nodes_[i] = Node{};
    nodes_[i].epoch = epoch;
    ++node_count_;
    return i;
  };
  if (index == none) {
    index = new_node();
    roots_.insert(key, index);
    keys_.push_back(key);
  }
  const Eigen::Vector3d origin = root_centre(group.mean);
  Eigen::Vector3d centre = origin;
  double quarter = config_.voxel_size / 4;
  bool above_is_plane = false;
  for (int level = 0;; ++level) {
    Node& node = nodes_[index];
    const bool settled = node.is_plane && node.moments.count() >= config_.full_points;
    if (settled_and_explains(node, group)) return;
    if (!settled) {
      node.moments.add(group, origin);
      // Below a plane the moments are kept, for the day it is none any more, but nothing is fitted.
      if (!above_is_plane) refit_if_due(node, origin);
    }
    if (level == depth) return;
    above_is_plane = above_is_plane || (node.is_plane && !settled);
    if (node.children == none) {
      const std::uint32_t table = children_.take();
      children_[table].fill(none);
      node.children = table;
    }
    const unsigned o = octant(group.mean, centre);
    centre = child_centre(centre, o, quarter);
    quarter *= 0.5;
    std::uint32_t& child = children_[node.children][o];
    if (child == none) child = new_node();
    index = child;
  }
}

void VoxelMap::free_tree(std::uint32_t index) {
  Node& node = nodes_[index];
  if (node.children != none) {
    for (const std::uint32_t child : children_[node.children]) {
      if (child != none) free_tree(child);
    }
    children_.give_back(node.children);
    node.children = none;
  }
  nodes_.give_back(index);
  --node_count_;
}

void VoxelMap::erase_root(VoxelKey key) {
  free_tree(roots_.find(key));
  roots_.erase(key);
}

void VoxelMap::forget(const Eigen::Vector3d& centre) {
  const bool too_many = node_count_ > static_cast<std::size_t>(config_.max_nodes);
  if (!too_many && (centre - last_forget_).norm() < 0.05 * config_.radius) return;
  last_forget_ = centre;
  const auto squared_distance = [&](VoxelKey key) { return (centre_of(key, config_.voxel_size) - centre).squaredNorm(); };
  const auto drop_beyond = [&](double radius) {
    std::erase_if(keys_, [&](VoxelKey key) {
      if (squared_distance(key) <= radius * radius) return false;
      erase_root(key);
      return true;
    });
  };
  drop_beyond(config_.radius);
  if (node_count_ > static_cast<std::size_t>(config_.max_nodes)) {
    // Keep the nearest four fifths of the roots, so that this is rare.
    std::vector<double> distances(keys_.size());
    std::transform(keys_.begin(), keys_.end(), distances.begin(), squared_distance);
    const auto cut = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() * 4 / 5);
    std::nth_element(distances.begin(), cut, distances.end());
    drop_beyond(std::sqrt(*cut));
  }
}

std::size_t VoxelMap::bytes_per_node() { return sizeof(Node) + sizeof(Children); }

std::size_t VoxelMap::memory_bytes() const {
  return nodes_.blocks.size() * block_size * sizeof(Node) + children_.blocks.size() * block_size * sizeof(Children) +
         roots_.capacity() * 16 + keys_.capacity() * sizeof(VoxelKey);
}

}  // namespace kilvo
