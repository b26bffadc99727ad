// The map that LiDAR, vision and contact share: a hash of root voxels, each an octree of depth two that subdivides where its points
// do not lie on one plane. Nodes keep moments, not points, so a node costs the same however often it is seen.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "kilvo/map/plane.hpp"
#include "kilvo/map/voxel_index.hpp"
#include "kilvo/math/field.hpp"

namespace kilvo {

struct MapConfig {
  double voxel_size = 1.0;  // m
  double min_points = 8;
  double max_roughness = 0.01;  // m
  double full_points = 2000;
  double radius = 120;  // m
  int max_nodes = 600000;

  static constexpr auto fields() {
    return std::tuple{
        Field{"voxel_size", &MapConfig::voxel_size, "m", "edge of a root voxel; it is halved twice where its points lie on no plane"},
        Field{"min_points", &MapConfig::min_points, "-", "fewer points make no plane"},
        Field{"max_roughness", &MapConfig::max_roughness, "m",
              "a surface that leaves its plane by more than this standard deviation, measurement noise apart, is no plane"},
        Field{"full_points", &MapConfig::full_points, "-", "a plane of this many points is settled and takes no more"},
        Field{"radius", &MapConfig::radius, "m", "voxels farther from the robot are forgotten"},
        Field{"max_nodes", &MapConfig::max_nodes, "-", "octree nodes at most; the farthest voxels are forgotten first"}};
  }
};

class VoxelMap {
 public:
  explicit VoxelMap(const MapConfig& config);

  /// A plane under a point and the node that holds it (equal ids: the same plane, so the same error).
  struct Match {
    const Plane* plane = nullptr;
    std::uint32_t node = 0;
    std::uint32_t epoch = 0;  // of the insertion that began the node
    std::uint32_t age = 0;    // sweeps since points first were there
    bool one_sided = false;   // the surface was seen from the side that the normal points to, from the other one it is another surface
  };

  /// Calls f(Match) for each plane whose voxel holds x, from the root voxel down to the sub-voxel, until f returns true.
  template <class F>
  bool visit_planes(const Eigen::Vector3d& x, F&& f) const;

  /// What visit_planes meets first at each of the points; no plane where there is none. Much faster for many points than one by one:
  /// they wait for memory together.
  void first_planes(std::span<const Eigen::Vector3d> points, std::span<Match> out) const;

  /// The largest voxel that holds x and is a plane.
  const Plane* plane_at(const Eigen::Vector3d& x) const;

  /// Adds groups of points in the world; each must fit within one leaf (edge leaf_size()). Planes are refitted as they grow. Nodes that
  /// begin now are marked with `epoch`: the caller's name for the pose error that they share. New planes turn their normals to
  /// `seen_from` (the LiDAR, in the world); without it they have two sides.
  void insert(std::span<const PointGroup> groups, std::uint32_t epoch, const std::optional<Eigen::Vector3d>& seen_from = {});

  /// The beams from `origin_W` to these `ends` (to some of them, others each time) met nothing before: a plane that beams
  /// keep passing through, and that no group is found on meanwhile, is not there any more and is forgotten with its points.
  void see_through(const Eigen::Vector3d& origin_W, std::span<const Eigen::Vector3d> ends);

  /// How likely a new surface moves, by those that beams passed through soon after their first points: 0 to 1.
  double moving_share() const { return moving_share_; }

  /// What the map holds has been there for long.
  void settle() { sweep_ += 1000; }

  /// Forgets voxels beyond the radius around `centre`, and the farthest ones while there are more than max_nodes.
  void forget(const Eigen::Vector3d& centre);

  double leaf_size() const { return config_.voxel_size / (1 << depth); }
  /// Points of one key are in one leaf: they meet the same planes.
  VoxelKey leaf_key(const Eigen::Vector3d& x) const {
    const Leaf l = leaf_of(x);
    return pack_key(l[0], l[1], l[2]);
  }
  bool empty() const { return roots_.size() == 0; }
  std::size_t node_count() const { return nodes_.used - nodes_.free.size(); }
  /// Above every node id that a Match can have now.
  std::size_t node_capacity() const { return nodes_.used; }
  std::size_t memory_bytes() const;

 private:
  static constexpr std::size_t block_size = 1024;
  static constexpr int depth = 2;

  // Three lines of the cache: registration reads the first two, insertion writes the last two.
  struct alignas(64) Node {
    Plane plane;
    bool is_plane = false;
    bool one_sided = false;
    std::uint8_t against = 0;  // sweeps with beams that passed through the plane, since points were found on it
    std::uint32_t epoch = 0;
    std::uint32_t children = no_index;  // index of its table of eight; none for leaves and undivided nodes
    std::uint32_t passed_in = 0;        // the last of those sweeps
    float fitted_count = 0;             // points at the last fit
    std::uint32_t born = 0;             // sweep of its first points
    Moments moments;
  };
  static_assert(sizeof(Plane) == 64 && sizeof(Node) == 192);
  using Children = std::array<std::uint32_t, 8>;
  // Fixed addresses, so growing never copies; freed entries are used again.
  template <class T>
  struct Pool {
    std::vector<std::unique_ptr<T[]>> blocks;
    std::vector<std::uint32_t> free;
    std::uint32_t used = 0;
    T& operator[](std::uint32_t i) { return blocks[i / block_size][i % block_size]; }
    const T& operator[](std::uint32_t i) const { return blocks[i / block_size][i % block_size]; }
    std::uint32_t take() {
      if (free.empty() && used == blocks.size() * block_size) blocks.push_back(std::make_unique<T[]>(block_size));
      if (free.empty()) return used++;
      const std::uint32_t i = free.back();
      free.pop_back();
      return i;
    }
  };

  // The leaf cell of a point, in integer coordinates: its upper bits are the root voxel, the lower ones the path through the octree.
  using Leaf = std::array<std::int64_t, 3>;
  Leaf leaf_of(const Eigen::Vector3d& x) const {
    return {fast_floor(x.x() * leaves_per_metre_), fast_floor(x.y() * leaves_per_metre_), fast_floor(x.z() * leaves_per_metre_)};
  }
  static VoxelKey root_key(const Leaf& l) { return pack_key(l[0] >> depth, l[1] >> depth, l[2] >> depth); }
  static std::size_t octant(const Leaf& l, int level) {
    const int bit = depth - 1 - level;
    return static_cast<std::size_t>((l[0] >> bit & 1) | (l[1] >> bit & 1) << 1 | (l[2] >> bit & 1) << 2);
  }
  Eigen::Vector3d root_centre(const Leaf& l) const;
  template <std::size_t first_line, class Stop>
  void walk_in_step(std::span<const Leaf> leaves, Stop&& stop) const;
  // What an insertion's groups have in common.
  struct Insertion {
    std::uint32_t epoch;
    const std::optional<Eigen::Vector3d>& seen_from;
  };
  void insert_one(const PointGroup& group, const Leaf& leaf, std::uint32_t root, const Insertion& insertion);
  bool is_settled(const Node& node) const { return node.is_plane && node.moments.count() >= config_.full_points; }
  static bool explains(const Plane& plane, const PointGroup& group);
  void refit_if_due(Node& node, const Eigen::Vector3d& origin, const std::optional<Eigen::Vector3d>& seen_from);
  // The nodes from a root voxel down to one of them.
  using Path = std::array<std::uint32_t, depth + 1>;
  void trace(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  bool is_passed(std::uint32_t root, const Leaf& leaf, const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::uint32_t& last);
  static constexpr std::size_t direction_cells = 8;  // along each side of the cube around all directions
  static std::size_t direction_cell(const Eigen::Vector3d& way);
  void forget_plane(const Path& path, int level, const Eigen::Vector3d& origin);
  void free_children(Node& node);
  void free_tree(std::uint32_t node);

  MapConfig config_;
  double leaves_per_metre_;
  VoxelIndex roots_;
  std::vector<VoxelKey> keys_;  // of all roots, in order of creation (no result depends on hash order)
  Pool<Node> nodes_;
  Pool<Children> children_;
  std::uint32_t sweep_ = 1000;               // counts the calls of see_through()
  double gone_soon_ = 0, moving_share_ = 1;  // planes of about a minute, which fade; 0 to 1
  std::uint32_t passed_last_ = 0;            // when a beam last passed through a plane
  std::vector<std::uint32_t> passed_in_;     // the same by direction
  Eigen::Vector3d last_forget_ = Eigen::Vector3d::Zero();
};

template <class F>
bool VoxelMap::visit_planes(const Eigen::Vector3d& x, F&& f) const {
  const Leaf leaf = leaf_of(x);
  std::uint32_t index = roots_.find(root_key(leaf));
  for (int level = 0; index != no_index; ++level) {
    const Node& node = nodes_[index];
    if (node.is_plane && f(Match{&node.plane, index, node.epoch, sweep_ - node.born, node.one_sided})) return true;
    if (node.children == no_index) return false;
    index = children_[node.children][octant(leaf, level)];
  }
  return false;
}

}  // namespace kilvo
