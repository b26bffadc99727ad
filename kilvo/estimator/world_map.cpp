#include "kilvo/estimator/world_map.hpp"

namespace kilvo {

void WorldMap::give(VoxelMap map) {
  surfaces_ = std::move(map);
  is_given_ = true;
}

void WorldMap::learn(const Registration& sweep, const PoseCovariance& unobservable, bool may_grow) {
  const SE3 T_WI = sweep.posterior.x.pose();
  if (is_given_) {
    if (sweep.carries) error_.registered_to_given(T_WI, sweep.by_epoch, sweep.systematic, unobservable);
    return;
  }
  if (!may_grow) return;
  if (sweep.carries) error_.registered(T_WI, sweep.by_epoch, sweep.systematic, unobservable);
  const std::uint32_t epoch = error_.epoch_now(T_WI, sweep.posterior.P.topLeftCorner<6, 6>());
  lidar_.range_noise = sweep.range_noise;
  const std::vector<PointGroup> seen = to_world(sweep.clusters, T_WI, p_IL_, lidar_);
  surfaces_.insert(seen, epoch);
  surfaces_.see_through(T_WI * p_IL_, seen);
  surfaces_.forget(sweep.posterior.x.p);
}

void WorldMap::begin_anew(const Estimate& e) {
  surfaces_ = VoxelMap(config_);
  // Nothing told how far away the robot is.
  constexpr double moved = 5.0, climbed = 1.0, turned = 0.5;  // m, m, rad
  PoseCovariance unknown = PoseCovariance::Zero();
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * -e.x.g.normalized();
  unknown.topLeftCorner<3, 3>() = turned * turned * up_I * up_I.transpose();
  unknown.diagonal().tail<3>() << moved * moved, moved * moved, climbed * climbed;
  error_.lost(e.x.pose(), unknown);
}

}  // namespace kilvo
