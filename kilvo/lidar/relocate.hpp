// Finding a sweep again in the map when the pose is too uncertain for the nearest planes to be the right ones: poses around the expected
// one are tried, the best of them registered, and the answer is taken only when no other pose explains the sweep as well.
#pragma once

#include <optional>
#include <span>

#include "kilvo/lidar/point_to_plane.hpp"

namespace kilvo {

/// The nearest planes are the right ones within so much, m and rad (one sigma of each axis).
inline constexpr double well_known_position = 0.08, well_known_rotation = 0.03;

/// Uncertain beyond what registration to the nearest planes bears. `known`: takes a pose error to its part that sweeps know here.
bool needs_search(const Covariance& P, const PoseCovariance& known);

struct FoundPose {
  State x;              // the expected one with the pose of the sweep
  Information<6> info;  // of the registration there
  double share = 0;     // of the clusters that met a surface: lie on it
};

/// Nothing when the sweep fits nowhere, or in two places alike.
std::optional<FoundPose> find_pose(const VoxelMap& map, std::span<const PointCluster> clusters, const Eigen::Vector3d& p_IL,
                                   const Estimate& expected, const LidarConfig& config, const Workers& workers);

/// What a found pose says about another iterate: the model for `update`.
Information<6> information_at(const FoundPose& found, const State& x);

}  // namespace kilvo
