#include "kilvo/estimator/moving_start.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kilvo/input/timeline.hpp"

namespace kilvo {
namespace {

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

void MovingStart::register_part(const LidarScan& part, History& history) {
  const Time begin = begin_of(part), end = end_of(part);
  if (begin < history.base().t) return;
  Estimate prior = history.at(end - (end - begin) / 2);
  history.record_from(prior, end);
  PointDrops drops;
  const Registration sweep = map_.register_sweep(lidar_, part, end, history, prior, drops);
  if (sweep.refused) return;
  history.correct_trajectory(sweep.posterior, sweep.posterior.x.v - prior.x.v);
  lidar_.accept(sweep);
  map_.learn(sweep, lidar_.unobservable(), true);
  history.rebase(sweep.posterior);
}

void MovingStart::add(const LidarScan& scan, History& history) {
  const Duration length = std::max<Duration>(std::chrono::milliseconds(1), from_seconds(0.25 / mount_.rate));
  for (const LidarScan& part : parts_of(scan, length)) register_part(part, history);
  Estimate e = history.base();
  const Eigen::Matrix3d of_velocity = e.P.block<3, 3>(at::v, at::v);
  const double sigma = std::sqrt(of_velocity.diagonal().maxCoeff());
  is_over_ = 8 * sigma < known_velocity || end_of(scan) - start_.t > std::chrono::seconds(2);
  const bool begins_anew = is_over_ || (!is_roughly_known_ && sigma < known_velocity);
  if (begins_anew) {
    e.P = start_.P;
    // Each part is registered to those before: they err alike.
    make_independent(e.P, at::v, 4 * of_velocity);
    lidar_ = LidarPipeline(mount_, config_.lidar, config_.update, config_.threads);
    map_ = WorldMap(config_.map, config_.lidar, mount_.T_imu_lidar.p);
  }
  if (begins_anew || !is_roughly_known_) {
    e.x.g = start_.x.g;
    e.x.ba = start_.x.ba;
    e.x.bg = start_.x.bg;
    for (const int part : {at::g, at::ba, at::bg}) make_independent(e.P, part, start_.P.block<3, 3>(part, part));
    history.rebase(e);
  }
  is_roughly_known_ = is_roughly_known_ || begins_anew;
  history.advance_to(end_of(scan));
}

}  // namespace kilvo
