#include "kilvo/estimator/leg_update.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/estimator/stopwatch.hpp"

namespace kilvo {

LegUpdate update_by_legs(const Feet& feet, Estimate& e, ContactDetector& contacts, StanceTracker& stances, Replay& replay,
                         const VoxelMap* map, StanceTracker::Ground ground) {
  LegUpdate out;
  const State& x = e.x;
  // Of the feet's own time: a late leg sample is older than the newest of the IMU.
  const ImuSample imu = replay.imu_at(feet.t);
  const Eigen::Vector3d omega = imu.gyro - x.bg;
  const double sigma_v = std::sqrt(std::max(0.0, e.P.block<3, 3>(at::v, at::v).trace() / 3));
  Stopwatch watch;
  contacts.update(feet, x, omega, imu.accel - x.ba, sigma_v, map);
  out.contact_us = watch.lap_us();
  out.step = stances.step(feet, contacts.contacts(), x, omega, sigma_v, map, ground);
  contacts.adapt(out.step, x, imu.gyro, ground);
  out.passed = replay.take(e, out.step);
  stances.judge(out.step, out.passed);
  return out;
}

}  // namespace kilvo
