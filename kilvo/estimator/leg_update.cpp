#include "kilvo/estimator/leg_update.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/estimator/stopwatch.hpp"

namespace kilvo {

LegUpdate update_by_legs(const Feet& feet, Estimate& e, ContactDetector& contacts, StanceTracker& stances, Replay& replay,
                         const VoxelMap* map, StanceTracker::Ground ground) {
  LegUpdate out;
  const State& x = e.x;
  const Eigen::Vector3d omega = replay.newest_imu().gyro - x.bg;
  const double sigma_v = std::sqrt(std::max(0.0, e.P.block<3, 3>(at::v, at::v).trace() / 3));
  Stopwatch watch;
  contacts.update(feet, x, omega, replay.newest_imu().accel - x.ba, sigma_v, map);
  out.contact_us = watch.lap_us();
  out.step = stances.step(feet, contacts.contacts(), x, omega, sigma_v, map, ground);
  contacts.adapt(out.step, x, replay.newest_imu().gyro, ground);
  out.passed = replay.take(e, out.step);
  stances.judge(out.step, out.passed);
  return out;
}

}  // namespace kilvo
