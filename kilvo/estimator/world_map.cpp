#include "kilvo/estimator/world_map.hpp"

namespace kilvo {

void WorldMap::give(VoxelMap map) {
  surfaces_ = std::move(map);
  surfaces_.settle();
  is_given_ = true;
}

void WorldMap::learn(const Registration& sweep, const PoseCovariance& unobservable, bool may_grow) {
  const SE3 T_WI = sweep.posterior.x.pose();
  if (sweep.carries) error_.lost(T_WI, sweep.released);
  if (sweep.carries && (is_given_ || may_grow)) error_.registered(T_WI, sweep.by_epoch, sweep.systematic, unobservable);
  if (is_given_ || !may_grow) return;
  const PoseCovariance P = sweep.posterior.P.topLeftCorner<6, 6>() + unobservable * sweep.considered * unobservable.transpose();
  const std::uint32_t epoch = error_.epoch_now(T_WI, P);
  lidar_.range_noise = sweep.range_noise;
  const Eigen::Vector3d lidar_W = T_WI * p_IL_;
  // A few at a time: what is made of them is used while it is in the cache.
  constexpr std::size_t at_once = 32;
  std::vector<Eigen::Vector3d> seen;
  for (std::span<const PointCluster> rest = sweep.clusters; !rest.empty(); rest = rest.subspan(std::min(at_once, rest.size()))) {
    const std::vector<PointGroup> groups = to_world(rest.first(std::min(at_once, rest.size())), T_WI, p_IL_, lidar_);
    surfaces_.insert(groups, epoch, lidar_W);
    for (const PointGroup& g : groups) seen.push_back(g.mean);
  }
  surfaces_.see_through(lidar_W, seen);
  surfaces_.forget(sweep.posterior.x.p);
}

// Where the prior is uncertain for what the accelerometer reported alone, the sweep fits where nothing has pushed the robot; where it fits,
// a push was not what was reported, and the velocity that it gave is not known.
Registration WorldMap::register_sweep(LidarPipeline& lidar, const LidarScan& scan, Time end, bool without_legs, History& history,
                                      Estimate& prior, const PoseCovariance& considered, PointDrops& drops) const {
  const PoseCovariance error = error_at(prior.x.pose());
  const ProcessNoise noise = history.replay().noise_within(prior.t - (end - prior.t), end);
  // The error of a given map is not the drift's.
  Estimate relative = prior;
  const PoseCovariance released =
      without_legs && !is_given_ ? lidar.release(relative, error, surfaces_.leaf_size() / 2) : PoseCovariance(PoseCovariance::Zero());
  Registration sweep =
      lidar.measure(scan, {end, relative, history.trajectory(), noise, error + released, without_legs, considered}, surfaces_, drops);
  if (sweep.carries) sweep.released = released;
  if (!sweep.carries) sweep.posterior = prior;
  const bool is_surprised = lidar.is_surprised(prior, sweep, error);
  if ((sweep.refused != Reason::fits_nowhere && !is_surprised) || (sweep.refused && !sweep.searched)) return sweep;
  auto doubted = history.doubted(prior.t, end, sweep.refused ? std::nullopt : std::optional((sweep.posterior.x.p - prior.x.p).norm()));
  if (!doubted) return sweep;
  const Estimate expected = doubted->at(prior.t);
  doubted->record_from(expected, end);
  PointDrops counted;
  const PoseCovariance error_there = error_at(expected.x.pose());
  Registration again =
      lidar.measure(scan, {end, expected, doubted->trajectory(), noise, error_there, without_legs, considered}, surfaces_, counted);
  if (again.refused || !again.carries || (!sweep.refused && !LidarPipeline::agrees(expected, again, error_there))) return sweep;
  history = std::move(*doubted);
  prior = expected;
  return again;
}

bool WorldMap::refuse_sweep(LidarPipeline& lidar, const Estimate& prior, Time end) {
  if (!lidar.refuse(end, is_given_)) return false;
  begin_anew(prior);
  return true;
}

void WorldMap::begin_anew(const Estimate& e) {
  surfaces_ = VoxelMap(config_);
  // The robot may be anywhere within these.
  constexpr double moved = 5.0, climbed = 1.0, turned = 0.5;  // m, m, rad
  PoseCovariance unknown = PoseCovariance::Zero();
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * -e.x.g.normalized();
  unknown.topLeftCorner<3, 3>() = turned * turned * up_I * up_I.transpose();
  unknown.diagonal().tail<3>() << moved * moved, moved * moved, climbed * climbed;
  error_.lost(e.x.pose(), unknown);
}

}  // namespace kilvo
