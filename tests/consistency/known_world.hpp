// The simulated world as a map: what a perfect LiDAR would have left of it.
#pragma once

#include <algorithm>
#include <vector>

#include "kilvo/map/voxel_map.hpp"
#include "lab/simulation/simulator.hpp"
#include "tests/helpers/surface_groups.hpp"

namespace kilvo::test {

/// Points on the surfaces as far as the LiDAR can see them from somewhere on its way, in the simulated world.
inline std::vector<Eigen::Vector3d> seen_points(const lab::Simulator& simulator) {
  std::vector<Eigen::Vector3d> stations;
  for (double t = 0; t < simulator.duration(); t += 1)
    stations.push_back(simulator.walk().torso(t) * simulator.config().shape.T_torso_lidar.p);
  const auto is_seen = [&](const Eigen::Vector3d& p, std::size_t surface) {
    return std::ranges::any_of(stations, [&](const Eigen::Vector3d& from) {
      const Eigen::Vector3d way = p - from;
      const auto hit = simulator.world().cast(from, way.normalized());
      return hit && hit->surface == surface && std::abs(hit->range - way.norm()) < 1e-3;
    });
  };
  std::vector<Eigen::Vector3d> points;
  const std::vector<lab::Surface>& surfaces = simulator.world().surfaces();
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    constexpr double spacing = 0.04;  // m
    for (const Eigen::Vector3d& p : points_on(surfaces[i].corner, surfaces[i].u, surfaces[i].v, spacing)) {
      if (is_seen(p, i)) points.push_back(p);
    }
  }
  return points;
}

/// The map of these points in the estimator's world. `T_WR`: the simulated world there.
inline VoxelMap known_world(std::vector<Eigen::Vector3d> points, const SE3& T_WR, const MapConfig& config = {}) {
  for (Eigen::Vector3d& p : points) p = T_WR * p;
  constexpr double practically_exact = 1e-5;  // m
  const std::vector<PointGroup> groups = groups_of(points, config.voxel_size / 4, practically_exact);
  VoxelMap map(config);
  // More than once: sub-voxels are fitted when points come after their voxel turned out to be no plane.
  for (int i = 0; i < 3; ++i) map.insert(groups, 0);
  return map;
}

}  // namespace kilvo::test
