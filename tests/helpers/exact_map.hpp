// A given map: the surfaces of the analytic room, known practically exactly.
#pragma once

#include <vector>

#include "kilvo/map/voxel_map.hpp"
#include "lab/simulation/analytic_room.hpp"
#include "tests/helpers/surface_groups.hpp"

namespace kilvo::test {

/// `T_MR`: the room in the map's frame.
inline VoxelMap exact_map(const std::vector<lab::Rectangle>& surfaces, const SE3& T_MR, const MapConfig& config = {}) {
  VoxelMap map(config);
  std::vector<Eigen::Vector3d> points;
  for (const lab::Rectangle& r : surfaces) {
    for (const Eigen::Vector3d& x : points_on(r.corner, r.u, r.v, 0.04)) points.push_back(T_MR * x);
  }
  const std::vector<PointGroup> groups = groups_of(points, config.voxel_size / 4, 1e-5);
  // More than once: sub-voxels are fitted when points come after their voxel turned out to be no plane.
  for (int i = 0; i < 3; ++i) map.insert(groups, 0);
  return map;
}

}  // namespace kilvo::test
