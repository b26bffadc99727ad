// A pose error (rotation in the body, position in the world; state.hpp) as a twist of the world at its origin, and back. Errors that poses
// far apart have in common are the same twist.
#pragma once

#include <cstdint>

#include "kilvo/filter/state.hpp"

namespace kilvo {

/// An earlier pose that a measurement was held against.
struct EarlierView {
  PoseCovariance error = PoseCovariance::Zero();  // of that pose, as a twist at the world's origin
  Eigen::Vector3d way = Eigen::Vector3d::Zero();  // from there, m
  double weight = 0;                              // how much of the measurement comes from it; their sum is 1
  double share = 0;                               // variance of the error of the distance, per distance^2
};

/// What measurements against one epoch of the map (VoxelMap::insert) know about the pose.
struct EpochInformation {
  std::uint32_t epoch = 0;
  PoseCovariance A = PoseCovariance::Zero();
  PoseCovariance kept = PoseCovariance::Zero();  // takes a pose error to what the update takes of it from there along weak directions
};

/// (theta in the body, error of p) -> twist: phi = R theta, u = dp + p x phi.
inline PoseCovariance to_origin(const SE3& T_WI) {
  PoseCovariance G = PoseCovariance::Zero();
  G.topLeftCorner<3, 3>() = T_WI.R.matrix();
  G.bottomLeftCorner<3, 3>() = skew(T_WI.p) * T_WI.R.matrix();
  G.bottomRightCorner<3, 3>().setIdentity();
  return G;
}

inline PoseCovariance from_origin(const SE3& T_WI) {
  PoseCovariance G = PoseCovariance::Zero();
  G.topLeftCorner<3, 3>() = T_WI.R.matrix().transpose();
  G.bottomLeftCorner<3, 3>() = -skew(T_WI.p);
  G.bottomRightCorner<3, 3>().setIdentity();
  return G;
}

}  // namespace kilvo
