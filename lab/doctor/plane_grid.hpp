// Planes in a grid of voxels: the surroundings as a registration needs them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace kilvo::lab {

struct GridPlane {
  Eigen::Vector3d n, centre;
  double variance = 0;  // m^2, of the points about the plane
};

class PlaneGrid {
 public:
  explicit PlaneGrid(double side);
  void insert(std::span<const Eigen::Vector3d> points);
  /// The plane in the voxel of this point, nullptr without one. Good until the next insert().
  const GridPlane* find(const Eigen::Vector3d& p);

 private:
  struct Voxel {
    double n = 0, fitted_n = 0;
    bool planar = false;
    GridPlane plane;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  };
  static constexpr std::uint32_t none = 0xffffffff;
  // Open addressing, half full at most.
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t voxel = none;
  };
  std::size_t slot_of(std::uint64_t key, std::size_t from) const;
  Voxel& voxel_of(std::uint64_t key, std::size_t from);
  void grow();
  void fit(Voxel& voxel, const Eigen::Vector3d& corner) const;

  double side_;
  std::vector<Slot> slots_;
  std::vector<Voxel> voxels_;
};

}  // namespace kilvo::lab
