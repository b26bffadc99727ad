#include "kilvo/legs/leg_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kilvo/legs/contact_estimator.hpp"
#include "kilvo/math/stopwatch.hpp"

namespace kilvo {
namespace {

// No foot of a robot that runs is off the ground for longer.
constexpr Duration longest_flight = std::chrono::milliseconds(500);

}  // namespace

OwnedDetector::OwnedDetector(const LegConfig& config)
    : method_(config.detector != nullptr ? config.detector() : std::make_unique<ContactEstimator>()) {
  if (config.detector == nullptr && config.contact != "kilvo")
    throw std::invalid_argument("legs.contact: '" + config.contact + "' needs LegConfig::detector");
}

LegPipeline::LegUpdate LegPipeline::measure(Feet feet, const Estimate& predicted, const ImuSample& imu, const VoxelMap* map,
                                            StanceTracker::Ground ground) {
  LegUpdate out;
  const bool on_legs_alone = ground == StanceTracker::Ground::use;
  if (always_height_) ground = StanceTracker::Ground::use;
  const Eigen::Matrix3d& M = motion_error_.matrix();
  for (FootPose& foot : feet.foot) {
    if (M.isZero(0)) break;
    for (std::size_t k = 0; k < static_cast<std::size_t>(foot.corners); ++k) {
      foot.p[k] -= M * foot.p[k];
      foot.v[k] -= M * foot.v[k];
    }
  }
  leg_length_ = std::max(leg_length_, feet.foot[0].p[0].norm());
  const State& x = predicted.x;
  const Eigen::Vector3d omega = imu.gyro - x.bg;
  const double sigma_v = std::sqrt(std::max(0.0, predicted.P.block<3, 3>(at::v, at::v).trace() / 3));
  Stopwatch watch;
  contacts_->update(feet, x, omega, imu.accel - x.ba, sigma_v, map);
  out.contact_us = watch.lap_us();
  for (std::size_t side = 0; side < 2; ++side) level_ground_.stands_at(side, x.pc[side]);
  out.step = stances_.step(feet, contacts_->contacts(), x, omega, sigma_v, {map, ground, on_legs_alone});
  if (has_level_ground_) find_level_ground(out.step, predicted, ground);
  contacts_->adapt(out.step, x, imu.gyro, {ground == StanceTracker::Ground::use, ground_sigma_});
  // As the filter sees it: the stance feet by their weights.
  Eigen::Vector3d velocity_I = Eigen::Vector3d::Zero();
  double weight = 0;
  for (const Stance& foot : out.step.foot) {
    if (!foot.used) continue;
    weight += 1 / foot.variance_scale;
    velocity_I -= (omega.cross(foot.point.p) + foot.point.v) / foot.variance_scale;
  }
  motion_error_.add(x, velocity_I / std::max(weight, 1e-9), weight, out.step.dt, on_legs_alone);
  return out;
}

// Where the map has no ground under a foot that comes down.
void LegPipeline::find_level_ground(LegStep& step, const Estimate& predicted, StanceTracker::Ground ground) {
  if (ground == StanceTracker::Ground::learn) return level_ground_.restart();
  for (std::size_t side = 0; side < 2; ++side) {
    Stance& foot = step.foot[side];
    if (!foot.begins) continue;
    const auto level = level_ground_.touchdown(side, predicted.x.pose() * foot.point.p, predicted);
    if (!level || foot.ground) continue;
    foot.ground = level;
    foot.level.reset();
  }
}

void LegPipeline::pose_is_measured(const Eigen::Matrix3d& unknown) {
  motion_error_.pose_is_measured(unknown);
  constexpr double mostly = 0.5;
  if (unknown(2, 2) < mostly) level_ground_.height_is_measured();
}

PoseCovariance LegPipeline::description_error(const State& x) const {
  PoseCovariance out = motion_error_.error(x);
  const Eigen::Vector3d up_W = -x.g.normalized();
  out.bottomRightCorner<3, 3>() += (level_ground_.stair_variance() + level_ground_.floor_variance()) * up_W * up_W.transpose();
  return out;
}

bool LegPipeline::has_lost_its_stance(const LegStep& step, bool on_legs_alone) {
  const bool carried = step.foot[0].used || step.foot[1].used;
  if (carried) last_used_stance_ = step.t;
  if (carried || !on_legs_alone) last_stance_ = step.t;
  if (step.t - last_stance_ < longest_flight) return false;
  restart();
  last_stance_ = step.t;
  return true;
}

bool LegPipeline::has_stood_lately(Time t) const { return t - last_used_stance_ < longest_flight; }

void LegPipeline::restart() {
  contacts_->restart();
  stances_.restart();
  level_ground_.restart();
}

}  // namespace kilvo
