#include "kilvo/estimator/world_map.hpp"

#include <algorithm>

#include "kilvo/lidar/relocate.hpp"

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

WorldMap::Attempt WorldMap::attempt(LidarPipeline& lidar, const Sweep& sweep, History history, Time middle, PointDrops drops) const {
  const Estimate prior = history.at(middle);
  history.record_from(prior, sweep.end);
  Registration found = measure(lidar, sweep, history, prior, drops);
  return {std::move(history), prior, std::move(found), drops};
}

Registration WorldMap::measure_near(LidarPipeline& lidar, const Sweep& sweep, const History& history, Estimate prior,
                                    const Estimate& released) const {
  PointDrops counted;
  prior.x = measure(lidar, sweep, history, released, counted).posterior.x;
  return measure(lidar, sweep, history, prior, counted);
}

WorldMap::Motion WorldMap::motion_between(const State& base, const State& prior) {
  const auto change = boxminus(prior, base);
  return {change.segment<3>(at::R).squaredNorm(), change.segment<3>(at::v).squaredNorm()};
}

bool WorldMap::is_violent(const Motion& motion) const {
  // Three times as much; of what is usual after standing the first steps are more.
  return motion.turned2 > 9 * std::max(well_known_rotation * well_known_rotation, usual_motion_.turned2) ||
         motion.pushed2 > 9 * std::max(known_velocity * known_velocity, usual_motion_.pushed2);
}

bool WorldMap::agrees(const Estimate& prior, const Registration& sweep) const {
  return !sweep.refused && sweep.carries &&
         LidarPipeline::squared_change(prior, sweep, error_at(prior.x.pose())) < LidarPipeline::agreeing_change;
}

bool WorldMap::is_lost(const Estimate& prior, const Registration& sweep) const {
  return !agrees(prior, sweep) && (sweep.refused || !PredictionCheck::is_small(PredictionCheck::error_between(prior.x, sweep.posterior.x)));
}

std::optional<WorldMap::Attempt> WorldMap::explain(LidarPipeline& lidar, const Sweep& sweep, const History& history, const Estimate& prior,
                                                   const Registration& out) {
  const bool is_contradicted = prediction_.contradicts(out), searches = is_contradicted && prediction_.is_to_be_searched_for();
  const auto explains = [&](const Registration& again) {
    return is_contradicted ? prediction_.explains(again, out) : again.carries && !again.refused;
  };
  const auto try_with = [&](std::optional<History> other) -> std::optional<Attempt> {
    if (!other) return std::nullopt;
    Attempt again = attempt(lidar, sweep, std::move(*other), prior.t);
    return (is_contradicted ? explains(again.sweep) : agrees(again.prior, again.sweep)) ? std::optional(std::move(again)) : std::nullopt;
  };
  const auto on_surfaces = [](const Attempt& a) {
    return static_cast<double>(a.sweep.report.matched) / std::max(1, a.sweep.report.clusters);
  };
  std::optional<Attempt> best, moved;
  if (!out.searched && (!out.refused || searches)) {
    Registration near = measure_near(lidar, sweep, history, prior, PredictionCheck::released(prior));
    if (searches && !explains(near)) near = measure_near(lidar, sweep, history, prior, prediction_.lost(prior));
    const auto off = PredictionCheck::error_between(prior.x, near.posterior.x);
    const bool is_far = PredictionCheck::is_far(off);
    if (explains(near) && !is_far) best = try_with(history.loosened(prior.t, off.turned, off.moved, prediction_.recurs()));
    const SE3 by = is_far ? near.posterior.x.pose() * prior.x.pose().inverse() : SE3{};
    const auto within = is_far ? PredictionCheck::Error{0.7 * well_known_rotation, 0.7 * well_known_position} : off;
    if (is_contradicted && explains(near) && (is_far || (!agrees(prior, out) && !PredictionCheck::is_small(off))))
      moved = try_with(history.moved(by, within.turned, within.moved));
    // No push changes the velocity by 3 m/s between two sweeps; where that comes again it was none that moved the robot.
    const bool is_pushed = was_moved_ || off.moved < 3 * to_seconds(prior.t - agreed_);
    constexpr double clearly = 1.03;  // times as many
    if (moved && best && is_pushed && on_surfaces(*moved) < clearly * on_surfaces(*best)) moved.reset();
    if (best && !moved) return prediction_.begin(prior.t, off), best;
  }
  // Samples are wrong only where no other pose explains the sweep, and where it is somewhere else without them.
  was_moved_ = moved.has_value();
  best = std::move(moved);
  const Replay& samples = history.replay();
  for (const auto& rate : {std::optional<Eigen::Vector3d>(), samples.gyro_at(history.base().t), std::optional(samples.mean_gyro())}) {
    if (best || !searches || !(is_lost(prior, out) || is_violent(motion_between(history.base().x, prior.x)))) break;
    best = try_with(history.doubted(sweep.end, rate));
    if (best && !out.refused && PredictionCheck::is_small(PredictionCheck::error_between(prior.x, best->sweep.posterior.x))) best.reset();
  }
  if (best) best->sweep.unpredicted = true;
  return best;
}

Registration WorldMap::register_sweep(LidarPipeline& lidar, const Sweep& sweep, History& history, Estimate& prior, PointDrops& drops) {
  const auto before = is_anew_ && surfaces_.empty() ? std::optional(error_) : std::nullopt;
  begin_frame_at(prior);
  const Estimate predicted = prior;
  Registration out;
  const auto go_on_with = [&](Attempt&& other) {
    history = std::move(other.history);
    prior = other.prior;
    out = std::move(other.sweep);
  };
  const auto& doubt = prediction_.error();
  if (auto doubted = doubt ? history.loosened(prior.t, doubt->turned, doubt->moved, prediction_.lasts()) : std::nullopt) {
    if (Attempt other = attempt(lidar, sweep, std::move(*doubted), prior.t, drops); other.sweep.carries) {
      drops = other.drops;
      go_on_with(std::move(other));
    }
  }
  // A doubt of a prior from which the sweep fits nowhere leaves no trace.
  if (!out.carries) out = measure(lidar, sweep, history, prior, drops);
  const auto surprise = prediction_.surprise(prior, out, error_at(prior.x.pose()), lidar.is_rejoining());
  const bool is_contradicted = prediction_.contradicts(out);
  std::optional<Attempt> other;
  if (is_contradicted || surprise == PredictionCheck::Surprise::again) {
    other = explain(lidar, sweep, history, prior, out);
  } else if (surprise == PredictionCheck::Surprise::first) {
    if (auto pushed = history.loosened(prior.t, 0, (out.posterior.x.p - prior.x.p).norm(), false)) {
      other = attempt(lidar, sweep, std::move(*pushed), prior.t);
      if (!agrees(other->prior, other->sweep)) other.reset();
    }
  }
  if (other) {
    go_on_with(std::move(*other));
  } else if (is_contradicted && !out.refused && is_lost(prior, out)) {
    out.refused = Reason::fits_nowhere;
    out.carries = false;
    out.posterior = prior;
  }
  if (!is_contradicted && out.carries) {
    was_moved_ = false;
    agreed_ = prior.t;
    const Motion motion = motion_between(history.base().x, predicted.x);
    usual_motion_.turned2 += (motion.turned2 - usual_motion_.turned2) / PredictionCheck::remembered;
    usual_motion_.pushed2 += (motion.pushed2 - usual_motion_.pushed2) / PredictionCheck::remembered;
  }
  // A frame begins with a sweep that is used.
  if (out.refused && before) error_ = *before;
  prediction_.learn(predicted, out, error_at(predicted.x.pose()));
  return out;
}

bool WorldMap::refuse_sweep(LidarPipeline& lidar, const Estimate& prior, Time end) {
  if (!lidar.refuse(end, is_given_)) return false;
  begin_anew(prior);
  return true;
}

void WorldMap::begin_frame_at(Estimate& prior) {
  if (!is_anew_ || !surfaces_.empty()) return;
  error_.lost(prior.x.pose(), prior.P.topLeftCorner<6, 6>());
  begin_frame(prior);
}

void WorldMap::begin_anew(const Estimate& e) {
  surfaces_ = VoxelMap(config_);
  prediction_ = {};
  is_anew_ = true;
  constexpr double moved = 5.0, climbed = 1.0, turned = 0.5;  // m, m, rad: the robot may be anywhere within these
  PoseCovariance unknown = PoseCovariance::Zero();
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * -e.x.g.normalized();
  unknown.topLeftCorner<3, 3>() = turned * turned * up_I * up_I.transpose();
  unknown.diagonal().tail<3>() << moved * moved, moved * moved, climbed * climbed;
  error_.lost(e.x.pose(), unknown);
}

}  // namespace kilvo
