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

WorldMap::Attempt WorldMap::attempt(LidarPipeline& lidar, const Sweep& sweep, History history, Time middle, PointDrops& drops) const {
  const Estimate prior = history.at(middle);
  history.record_from(prior, sweep.end);
  Registration found = measure(lidar, sweep, history, prior, drops);
  return {std::move(history), prior, std::move(found)};
}

Registration WorldMap::measure_near(LidarPipeline& lidar, const Sweep& sweep, const History& history, Estimate prior,
                                    const Estimate& released) const {
  PointDrops counted;
  prior.x = measure(lidar, sweep, history, released, counted).posterior.x;
  return measure(lidar, sweep, history, prior, counted);
}

Registration WorldMap::register_sweep(LidarPipeline& lidar, const Sweep& sweep, History& history, Estimate& prior, PointDrops& drops) {
  const Estimate predicted = prior;
  Registration out;
  const auto go_on_with = [&](Attempt&& other) {
    history = std::move(other.history);
    prior = other.prior;
    out = std::move(other.sweep);
  };
  const auto& doubt = prediction_.error();
  if (auto doubted = doubt ? history.loosened(prior.t, doubt->turned, doubt->moved, prediction_.lasts()) : std::nullopt) {
    PointDrops counted = drops;
    if (Attempt other = attempt(lidar, sweep, std::move(*doubted), prior.t, counted); other.sweep.carries) {
      go_on_with(std::move(other));
      drops = counted;
    }
  }
  // A doubt of a prior from which the sweep fits nowhere leaves no trace.
  if (!out.carries) out = measure(lidar, sweep, history, prior, drops);
  const auto try_again_with = [&](std::optional<History> other, const auto& is_right) {
    if (!other) return false;
    PointDrops counted;
    Attempt again = attempt(lidar, sweep, std::move(*other), prior.t, counted);
    if (again.sweep.refused || !again.sweep.carries || !is_right(again.prior, again.sweep)) return false;
    go_on_with(std::move(again));
    return true;
  };
  const auto agrees = [&](const Estimate& expected, const Registration& again) {
    return LidarPipeline::squared_change(expected, again, error_at(expected.x.pose())) < LidarPipeline::agreeing_change;
  };
  const auto surprise = prediction_.surprise(prior, out, error_at(prior.x.pose()), lidar.is_rejoining());
  const bool is_contradicted = prediction_.contradicts(out);
  if (is_contradicted || surprise == PredictionCheck::Surprise::again) {
    const auto explains = [&](const Registration& again) {
      return is_contradicted ? prediction_.explains(again, out) : again.carries && !again.refused;
    };
    Registration near = measure_near(lidar, sweep, history, prior, PredictionCheck::released(prior));
    if (is_contradicted && !explains(near) && prediction_.is_to_be_searched_for())
      near = measure_near(lidar, sweep, history, prior, PredictionCheck::lost(prior));
    const auto off = PredictionCheck::error_between(prior.x, near.posterior.x);
    const auto is_right = [&](const Estimate& expected, const Registration& again) {
      return is_contradicted ? explains(again) : agrees(expected, again);
    };
    if (explains(near) && try_again_with(history.loosened(prior.t, off.turned, off.moved, prediction_.recurs()), is_right))
      prediction_.begin(prior.t, off);
  } else if (surprise == PredictionCheck::Surprise::first) {
    try_again_with(history.loosened(prior.t, 0, (out.posterior.x.p - prior.x.p).norm(), false), agrees);
  } else if (out.searched && out.refused == Reason::fits_nowhere) {
    try_again_with(history.doubted(sweep.end), [](const auto&...) { return true; });
  }
  prediction_.learn(predicted, out, error_at(predicted.x.pose()));
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
