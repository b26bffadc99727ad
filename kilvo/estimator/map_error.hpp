// How wrong the map itself is. A map built by the estimator carries the pose errors of the sweeps that built it; registration against it
// makes the pose certain relative to the map, not to the start. So the filter's covariance P is of the pose relative to the map around,
// and what is reported is P + D: D is the error of the map that the last sweep was registered to, from the pose covariances at which
// its planes were first inserted.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kilvo/filter/pose_error.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/lidar/point_to_plane.hpp"

namespace kilvo {

class MapError {
 public:
  /// D at a pose, for the errors (rotation, position) of state.hpp.
  PoseCovariance at(const SE3& T_WI) const;

  /// The epoch that planes inserted now belong to: planes of one epoch share their pose error, of covariance P + D.
  std::uint32_t epoch_now(const SE3& T_WI, const PoseCovariance& P);

  /// A sweep was registered with these informations against planes of each epoch; D becomes what their errors do to the pose. They
  /// are taken as fully correlated, which bounds it from above. Along directions that the sweep did not know (`weak`: a pose error
  /// to its part along them) D stays what it was, but for what the update took from the planes (EpochInformation::kept).
  /// `systematic`: LidarModel::systematic(). Planes of no epoch (of a map that was given) are where they should be.
  void registered(const SE3& T_WI, std::span<const EpochInformation> epochs, const PoseCovariance& systematic, const PoseCovariance& weak);

  /// What is around is wrong by so much more: the map restarts there, or the pose is taken relative to it.
  void lost(const SE3& T_WI, const PoseCovariance& more);

  /// P + D as a twist at the world's origin.
  PoseCovariance total(const SE3& T_WI, const PoseCovariance& P) const;

  /// Along `weak`, which no sweep measures, D becomes the error of the views plus that of the distance from them.
  void seen(const SE3& T_WI, std::span<const EarlierView> views, const PoseCovariance& weak);

 private:
  std::vector<PoseCovariance> epochs_;           // as twists at the world's origin
  PoseCovariance now_ = PoseCovariance::Zero();  // likewise
};

}  // namespace kilvo
