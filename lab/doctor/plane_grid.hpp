// Planes in a grid of voxels: the surroundings as a registration needs them.
#pragma once

#include <Eigen/Core>
#include <unordered_map>

namespace kilvo::lab {

struct GridPlane {
  Eigen::Vector3d n, centre;
  double variance = 0;  // m^2, of the points about the plane
};

class PlaneGrid {
 public:
  explicit PlaneGrid(double side) : side_(side) {}
  void insert(const Eigen::Vector3d& p);
  /// The plane in the voxel of this point, nullptr without one.
  const GridPlane* find(const Eigen::Vector3d& p);

 private:
  struct Voxel {
    double n = 0, fitted_n = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    GridPlane plane;
    bool planar = false;
  };
  std::int64_t key(const Eigen::Vector3d& p) const;
  void fit(Voxel& voxel, const Eigen::Vector3d& corner) const;

  double side_;
  std::unordered_map<std::int64_t, Voxel> voxels_;
};

}  // namespace kilvo::lab
