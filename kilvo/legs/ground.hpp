// The ground under a foot: from the map where it has a plane there, otherwise from where the feet stood (LevelGround, GroundLookup).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "kilvo/map/voxel_map.hpp"

namespace kilvo {

/// Ground that is higher or lower by more is reached by a step, m.
inline constexpr double stair = 0.1;

/// A piece of ground in the world.
struct GroundPatch {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // upwards
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    // m
  double sigma = 0;                                   // of its height along the normal, roughness included, m
  bool measures_gravity = false;                      // level, so that its normal is the vertical, as the state has it then

  /// Over the patch, along its normal, m.
  double height_of(const Eigen::Vector3d& p_W) const { return normal.dot(p_W - point); }
};

class GroundLookup {
 public:
  /// The plane of the voxel map that a foot at p_W stands on: of the root or sub-voxel that holds it, the nearest one that is no steeper
  /// than 30 degrees. `up_W`: unit vector against gravity.
  static std::optional<GroundPatch> of_map(const VoxelMap& map, const Eigen::Vector3d& p_W, const Eigen::Vector3d& up_W);

  /// The plane through the last places of the feet, if one explains them all; level where they leave it open. None before a foot has stood.
  std::optional<GroundPatch> of_contacts(const Eigen::Vector3d& up_W) const;

  /// The map's, or else that of the contacts.
  std::optional<GroundPatch> under(const VoxelMap* map, const Eigen::Vector3d& p_W, const Eigen::Vector3d& up_W) const;

  /// A foot has come down here.
  void stands_at(const Eigen::Vector3d& p_W);
  void forget() { count_ = 0; }

 private:
  static constexpr std::size_t memory = 5;
  std::array<Eigen::Vector3d, memory> contacts_;
  std::size_t count_ = 0;  // of all that came; the last `memory` are kept
};

}  // namespace kilvo
