// Groups of points on surfaces, as a LiDAR map would be given them: one group per cell, without measurement errors.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "kilvo/map/plane.hpp"

namespace kilvo::test {

/// The points by cells of the world's grid, each cell one group; `sigma`: the measurement noise that they claim, each axis, m.
inline std::vector<PointGroup> groups_of(const std::vector<Eigen::Vector3d>& points, double cell, double sigma) {
  std::map<std::array<double, 3>, std::vector<Eigen::Vector3d>> cells;
  for (const Eigen::Vector3d& x : points)
    cells[{std::floor(x.x() / cell), std::floor(x.y() / cell), std::floor(x.z() / cell)}].push_back(x);
  std::vector<PointGroup> groups;
  for (const auto& [key, members] : cells) {
    PointGroup g;
    g.count = static_cast<double>(members.size());
    for (const Eigen::Vector3d& x : members) g.mean += x / g.count;
    for (const Eigen::Vector3d& x : members) g.scatter += (x - g.mean) * (x - g.mean).transpose();
    g.noise = sigma * sigma * Eigen::Matrix3d::Identity();
    groups.push_back(g);
  }
  return groups;
}

inline std::vector<Eigen::Vector3d> means_of(const std::vector<PointGroup>& groups) {
  std::vector<Eigen::Vector3d> means;
  for (const PointGroup& g : groups) means.push_back(g.mean);
  return means;
}

/// A grid of points on corner + a u + b v, a and b in [0, 1], about `spacing` apart and none on the rim.
inline std::vector<Eigen::Vector3d> points_on(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                                              double spacing) {
  std::vector<Eigen::Vector3d> out;
  const int nu = static_cast<int>(std::ceil(u.norm() / spacing)), nv = static_cast<int>(std::ceil(v.norm() / spacing));
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) out.push_back(corner + (i + 0.5) / nu * u + (j + 0.5) / nv * v);
  }
  return out;
}

}  // namespace kilvo::test
