#include "kilvo/estimator/moving_start.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {
namespace {

// Within one a walking robot smears a surface by no more than it is rough.
constexpr double parts_of_a_sweep = 4;
// By so much better than has a shape a sweep's velocity is known in the end: it smears by less than a millimetre.
constexpr double well_known = 8;

std::vector<LidarScan> parts_of(const LidarScan& scan, Duration length) {
  const Time begin = begin_of(scan);
  std::vector<LidarScan> out(static_cast<std::size_t>((end_of(scan) - begin) / length + 1), {scan.t, {}});
  for (const LidarPoint& p : scan.points)
    out[static_cast<std::size_t>((scan.t + Duration(p.offset_ns) - begin) / length)].points.push_back(p);
  std::erase_if(out, [](const LidarScan& part) { return part.points.empty(); });
  return out;
}

// A part of the state as it was; nothing else goes with it.
void make_independent(Covariance& P, int part, const Eigen::Matrix3d& variance) {
  P.middleRows<3>(part).setZero();
  P.middleCols<3>(part).setZero();
  P.block<3, 3>(part, part) = variance;
}

}  // namespace

MovingStart::MovingStart(const LidarMount& mount, const EstimatorConfig& config, const Estimate& start)
    : mount_(mount),
      config_(config),
      start_(start),
      lidar_(mount, config.lidar, config.update, config.threads),
      map_(config.map, config.lidar, mount.T_imu_lidar.p) {}

void MovingStart::begin_map(Estimate& e) {
  const PoseCovariance error = map_.error_at(e.x.pose()) + e.P.topLeftCorner<6, 6>();
  lidar_ = LidarPipeline(mount_, config_.lidar, config_.update, config_.threads);
  map_ = WorldMap(config_.map, config_.lidar, mount_.T_imu_lidar.p);
  map_.begin_at(e.x.pose(), error);
  for (const int part : {at::R, at::p}) make_independent(e.P, part, start_.P.block<3, 3>(part, part));
}

void MovingStart::guess_again(Estimate& e) const {
  e.x.g = start_.x.g;
  e.x.ba = start_.x.ba;
  e.x.bg = start_.x.bg;
  for (const int part : {at::g, at::ba, at::bg}) make_independent(e.P, part, start_.P.block<3, 3>(part, part));
}

// Along a corridor parts seem to know what they do not: nothing is known then of the velocity, nor of how far it has taken the robot.
void MovingStart::doubt_velocity(Estimate& e) {
  const Eigen::Matrix3d of_velocity = start_.P.block<3, 3>(at::v, at::v);
  make_independent(e.P, at::v, of_velocity);
  const double since = to_seconds(e.t - start_.t);
  PoseCovariance way = PoseCovariance::Zero();
  way.bottomRightCorner<3, 3>() = since * since * of_velocity;
  map_.begin_at(e.x.pose(), way);
}

bool MovingStart::register_part(const LidarScan& part, History& history, PointDrops& drops) {
  const Time begin = begin_of(part), end = end_of(part);
  if (begin < history.base().t) return false;
  Estimate prior = history.at(end - (end - begin) / 2);
  history.record_from(prior, end);
  if (map_.surfaces().empty()) begin_map(prior);
  const Registration sweep = map_.register_sweep(lidar_, {part, end, true}, history, prior, drops);
  if (sweep.refused || !is_plausible(sweep.posterior) || !is_definite(sweep.posterior.P)) return false;
  history.correct_trajectory(sweep.posterior, sweep.posterior.x.v - prior.x.v);
  lidar_.accept(sweep);
  map_.learn(sweep, lidar_.unobservable(), true);
  history.rebase(sweep.posterior);
  return true;
}

bool MovingStart::add(const LidarScan& scan, History& history, PointDrops& drops) {
  if (!first_sweep_) first_sweep_ = begin_of(scan);
  const Duration length = std::max<Duration>(std::chrono::milliseconds(1), from_seconds(1 / (parts_of_a_sweep * mount_.rate)));
  bool any = false;
  for (const LidarScan& part : parts_of(scan, length)) any = register_part(part, history, drops) || any;
  Estimate e = history.base();
  const Eigen::Matrix3d of_velocity = e.P.block<3, 3>(at::v, at::v);
  const double sigma = std::sqrt(std::max(0.0, of_velocity.diagonal().maxCoeff()));
  const bool was_roughly_known = std::exchange(is_roughly_known_, sigma < known_velocity);
  const bool is_known = was_roughly_known && well_known * sigma < known_velocity;
  is_over_ = is_known || end_of(scan) - *first_sweep_ > longest_moving_start;
  const bool begins_anew = is_over_ || is_roughly_known_ != was_roughly_known;
  if (begins_anew) {
    begin_map(e);
    make_independent(e.P, at::v, 4 * of_velocity);  // parts are registered to those before: they err alike
  }
  if (is_over_ && !is_known) doubt_velocity(e);
  if (begins_anew || !is_roughly_known_) {
    guess_again(e);
    history.rebase(e);
  }
  history.advance_to(end_of(scan));
  return any;
}

void MovingStart::give_up(History& history, Time now) {
  if (!first_sweep_) return;
  is_over_ = true;
  Estimate e = history.base();
  begin_map(e);
  doubt_velocity(e);
  guess_again(e);
  history.rebase(e);
  history.advance_to(now);
}

}  // namespace kilvo
