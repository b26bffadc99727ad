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

Registration WorldMap::measure(LidarPipeline& lidar, const Sweep& sweep, const History& history, const Estimate& prior,
                               PointDrops& drops) const {
  const PoseCovariance error = error_at(prior.x.pose());
  const ProcessNoise noise = history.replay().noise_within(prior.t - (sweep.end - prior.t), sweep.end);
  // The error of a given map is not the drift's.
  Estimate relative = prior;
  const PoseCovariance released =
      sweep.without_legs && !is_given_ ? lidar.release(relative, error, surfaces_.leaf_size() / 2) : PoseCovariance(PoseCovariance::Zero());
  const LidarPipeline::Context context = {sweep.end,        relative,           history.trajectory(), noise,
                                          error + released, sweep.without_legs, sweep.considered};
  Registration out = lidar.measure(sweep.scan, context, surfaces_, drops);
  if (out.carries) out.released = released;
  if (!out.carries) out.posterior = prior;
  return out;
}

// Where the prior is uncertain for what the accelerometer reported alone, the sweep fits where nothing has pushed the robot.
Registration WorldMap::register_sweep(LidarPipeline& lidar, const Sweep& sweep, History& history, Estimate& prior, PointDrops& drops) {
  const auto go_on_with = [&](History&& other) {
    history = std::move(other);
    prior = history.at(prior.t);
    history.record_from(prior, sweep.end);
  };
  const State predicted = prior.x;
  if (const auto& e = prediction_.error()) {
    if (auto looser = history.loosened(prior.t, e->turned, e->moved, prediction_.lasts())) go_on_with(std::move(*looser));
  }
  Registration out = measure(lidar, sweep, history, prior, drops);
  PointDrops counted;  // before
  const auto try_again_with = [&](std::optional<History> other, const auto& is_right) {
    if (!other) return false;
    const Estimate expected = other->at(prior.t);
    other->record_from(expected, sweep.end);
    Registration again = measure(lidar, sweep, *other, expected, counted);
    if (again.refused || !again.carries || !is_right(expected, again)) return false;
    history = std::move(*other);
    prior = expected;
    out = std::move(again);
    return true;
  };
  const auto explains = [&](const Estimate&, const Registration& again) { return prediction_.explains(again, out); };
  const auto agrees = [&](const Estimate& expected, const Registration& again) {
    return LidarPipeline::squared_change(expected, again, error_at(expected.x.pose())) < LidarPipeline::agreeing_change;
  };
  const auto surprise = lidar.is_rejoining() ? PredictionCheck::Surprise::none : prediction_.surprise(prior, out, error_at(prior.x.pose()));
  const bool is_contradicted = prediction_.contradicts(out);
  if (is_contradicted || surprise == PredictionCheck::Surprise::again) {
    // With the gate of the prior again: an uncertain one lets almost everything lie on the surfaces.
    Estimate there = prior;
    there.x = measure(lidar, sweep, history, PredictionCheck::released(prior), counted).posterior.x;
    const Registration near = measure(lidar, sweep, history, there, counted);
    const auto off = PredictionCheck::error_between(prior.x, near.posterior.x);
    const bool is_right = is_contradicted ? prediction_.explains(near, out) : near.carries && !near.refused;
    auto looser = is_right ? history.loosened(prior.t, off.turned, off.moved, false) : std::nullopt;
    if (is_contradicted ? try_again_with(std::move(looser), explains) : try_again_with(std::move(looser), agrees)) prediction_.begin(off);
  } else if (surprise == PredictionCheck::Surprise::first) {
    try_again_with(history.loosened(prior.t, 0, (out.posterior.x.p - prior.x.p).norm(), false), agrees);
  } else if (out.searched && out.refused == Reason::fits_nowhere) {
    try_again_with(history.doubted(sweep.end), [](const auto&...) { return true; });
  }
  prediction_.learn(predicted, out);
  return out;
}

bool WorldMap::refuse_sweep(LidarPipeline& lidar, const Estimate& prior, Time end) {
  if (!lidar.refuse(end, is_given_)) return false;
  begin_anew(prior);
  return true;
}

void WorldMap::begin_anew(const Estimate& e) {
  surfaces_ = VoxelMap(config_);
  prediction_ = {};
  // The robot may be anywhere within these.
  constexpr double moved = 5.0, climbed = 1.0, turned = 0.5;  // m, m, rad
  PoseCovariance unknown = PoseCovariance::Zero();
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * -e.x.g.normalized();
  unknown.topLeftCorner<3, 3>() = turned * turned * up_I * up_I.transpose();
  unknown.diagonal().tail<3>() << moved * moved, moved * moved, climbed * climbed;
  error_.lost(e.x.pose(), unknown);
}

}  // namespace kilvo
