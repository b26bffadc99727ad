// The acceleration of legs whose turning tells nothing: the mount of the IMU by its direction, and whether it is the robot's at all.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {

// The mount to which fits from this one lead, and its fit: by a mount that is off the wrong foot seems to be the lower one.
std::pair<SO3, LegAcceleration> Examination::accelerated_mount(const std::vector<LegPose>& path, const MeasuredForce& force, SO3 R,
                                                               LegAcceleration fit) const {
  constexpr int steps = 4;
  constexpr double better = 0.97, not_worse = 1.03;  // of what differs
  for (int k = 0; k < steps && fit.good; ++k) {
    const SO3 next = SO3::Exp(-fit.turn) * R;
    const LegAcceleration then = leg_acceleration(path, force, next, leg_offset_);
    const bool comes_nearer = then.turn.norm() < 0.5 * fit.turn.norm();
    if (!then.good || then.differs() > (comes_nearer ? not_worse : better) * fit.differs()) break;
    R = next;
    fit = then;
  }
  return {R, fit};
}

// The acceleration has a direction, which shows the mount of the IMU without any hypothesis.
bool Examination::find_accelerated_mount(const std::vector<LegPose>& path, const MeasuredForce& force, const LegAcceleration& described) {
  const auto [R, fit] = accelerated_mount(path, force, robot_.imu.T_link_imu.R, described);
  constexpr double most = 0.8;  // differs: right ones on 34 walks by up to 0.74
  if (!fit.good || fit.differs() > most || sure * fit.scale_sigma >= fit.least_scale) return false;
  const double sigma = std::hypot(fit.mount_method(), fit.sigma.norm());
  const double turn = (R * robot_.imu.T_link_imu.R.inverse()).Log().norm();
  if (turn < sure * sigma || fit.turn.norm() > 0.5 * sure * sigma) return false;
  find_turned_imu(R, fmt::format("by the acceleration of the legs over standing soles by {:.1f} degrees, standard deviation {:.1f}",
                                 degrees(turn), degrees(sigma)));
  return true;
}

// Legs whose turning and standing tell nothing may be right, on soft ground: then their acceleration differs from the accelerometer's by
// less than that of legs that do not move would. A robot that hangs, or is carried, is not moved by legs that step in the air.
bool Examination::acceleration_contradicts_legs(const std::string& evidence) {
  const auto is_explained = [](const Finding& f) { return f.sensor != Sensor::lidar && !f.cause.ends_with("_rate"); };
  if (seems_wrong(Sensor::legs) || seems_wrong(Sensor::imu) || std::ranges::any_of(diagnosis_.findings, is_explained)) return false;
  if (!legs_.turned || recorded_.reading.leg_clock_is_found) return false;
  if (tilt_under(robot_.imu.T_link_imu.R, false).value_or(0) > most_tilt) return false;
  const LegAcceleration fit = leg_acceleration(nullptr, robot_.imu.T_link_imu.R, leg_offset_);
  constexpr double of_right_ones = 0.8, of_none = 1;  // on 34 right walks of levels 0 to 2 up to 0.68
  constexpr double of_a_walk = 0.5;                   // m/s^2, rms
  if (fit.rows == 0 || fit.acceleration < of_a_walk || fit.contradicts < of_none ||
      smaller_by(of_right_ones + fit.noise, fit.contradicts + fit.noise, fit.independent) < sure)
    return false;
  accuse_leg_joints(
      fmt::format("{}; their acceleration over standing soles differs from the accelerometer's by {:.2f} of its square, that "
                  "of legs that do not move by 1",
                  evidence, fit.contradicts));
  return true;
}

}  // namespace kilvo::lab
