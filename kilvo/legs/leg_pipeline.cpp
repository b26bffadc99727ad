#include "kilvo/legs/leg_pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/math/stopwatch.hpp"

namespace kilvo {
namespace {

// No foot of a robot that runs is off the ground for longer.
constexpr Duration longest_flight = std::chrono::milliseconds(500);

}  // namespace

LegPipeline::LegUpdate LegPipeline::measure(const Feet& feet, const Estimate& predicted, const ImuSample& imu, const VoxelMap* map,
                                            StanceTracker::Ground ground) {
  LegUpdate out;
  const bool on_legs_alone = ground == StanceTracker::Ground::use;
  if (always_height_) ground = StanceTracker::Ground::use;
  leg_length_ = std::max(leg_length_, feet.foot[0].p[0].norm());
  const State& x = predicted.x;
  const Eigen::Vector3d omega = imu.gyro - x.bg;
  const double sigma_v = std::sqrt(std::max(0.0, predicted.P.block<3, 3>(at::v, at::v).trace() / 3));
  Stopwatch watch;
  contacts_.update(feet, x, omega, imu.accel - x.ba, sigma_v, map);
  out.contact_us = watch.lap_us();
  stances_.set_on_legs_alone(on_legs_alone);
  out.step = stances_.step(feet, contacts_.contacts(), x, omega, sigma_v, map, ground);
  contacts_.adapt(out.step, x, imu.gyro, ground);
  if (on_legs_alone) reckoning_.add(x);
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
  contacts_.restart();
  stances_.restart();
}

}  // namespace kilvo
