// Legs without a LiDAR whose way is known: their acceleration over standing soles against the accelerometer's.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {

LegAcceleration Examination::leg_acceleration(const LegHypothesis* hypothesis, const SO3& R_link_imu, double offset) const {
  // The acceleration is not what was measured.
  if (std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "accel_gravity"; })) return {};
  return fit_leg_acceleration(legs_under(hypothesis), mended_imu(), gyro(), {R_link_imu, robot_.imu.T_link_imu.p}, offset);
}

// Joints and soles that turn as the gyro does, or hardly turn, may still not accelerate as the robot does.
bool Examination::try_acceleration_hypotheses() {
  if (!lidar_way().empty()) return false;
  const SO3 R = robot_.imu.T_link_imu.R;
  const LegAcceleration described = leg_acceleration(nullptr, R, leg_offset_);
  constexpr double well = 0.95;  // of the acceleration
  if (described.rows == 0 || described.explained > well) return false;
  std::vector<LegHypothesis> all = leg_hypotheses(recorded_legs_, robot_);
  for (LegHypothesis& h : foot_link_hypotheses(recorded_legs_, robot_)) all.push_back(std::move(h));
  const LegHypothesis* best = nullptr;
  LegAcceleration then;
  double least = 1 - well;
  for (const LegHypothesis& h : all) {
    if (h.culprit != Sensor::legs) continue;
    const LegAcceleration other = leg_acceleration(&h, R, leg_offset_);
    // Many are tried: one that needs another mount or size besides fits by chance.
    constexpr double near = 0.1, alike = 1.1;  // rad, -
    // Of a robot that stands, or has walked for two seconds, no size is known.
    const bool known = other.good && sure * other.scale_sigma < other.least_scale;
    if (!known || 1 - other.explained >= least || other.turn.norm() > near || other.least_scale > alike || alike * other.most_scale < 1)
      continue;
    least = 1 - other.explained;
    then = other;
    best = &h;
  }
  if (best == nullptr) return false;
  if (smaller_by(least, 1 - described.explained, std::min(described.independent, then.independent)) < sure_among(all.size())) {
    seems_wrong(best->culprit) = true;
    return false;
  }
  Finding f{best->culprit, best->cause, best->name, {}, best->setting, 0, {}, {}, true};
  f.evidence = fmt::format("{:.1f} % of the acceleration over standing soles is the accelerometer's then, {:.1f} % as described",
                           100 * then.explained, 100 * described.explained);
  find_on_legs(std::move(f), *best);
  return true;
}

// The velocities that the messages give against the differences of their positions.
void Examination::examine_joint_speeds() {
  double both = 0, turned = 0, given = 0, n = 0;
  const std::vector<std::size_t> joints = recorded_legs_.joints_that_matter(robot_);
  constexpr double longest = 0.03;  // s: a step takes ten times as long
  for (std::size_t k = 1; k < recorded_.legs.size(); ++k) {
    const LegSample &a = recorded_.legs[k - 1], &b = recorded_.legs[k];
    const double dt = b.t - a.t;
    if (!(dt > 0 && dt < longest) || a.velocity.size() != a.position.size() || b.velocity.size() != b.position.size()) continue;
    // Weighed by the time: of stamps that jitter the differences of a short time tell little.
    for (const std::size_t i : joints) {
      const double turn = b.position[i] - a.position[i];
      const double by_velocity = 0.5 * (a.velocity[i] + b.velocity[i]) * dt;
      both += turn * by_velocity;
      given += by_velocity * by_velocity;
      turned += turn * turn;
      n += dt * dt;
    }
  }
  constexpr double least_rate = 0.1, least_ratio = 0.5, most_ratio = 2;  // rad/s, -: filters of a driver take less
  if (!(n > 0) || turned < least_rate * least_rate * n) return;
  const double ratio = both / turned;
  const std::string detail = fmt::format("the velocities are {:.3g} times the change of the positions", ratio);
  // Positions that jump differ by more than any velocity.
  constexpr double clearly = 0.5;  // squared correlation
  const bool alike = both * both > clearly * turned * given;
  if ((given > 0 && !alike) || (ratio > least_ratio && ratio < most_ratio)) {
    check(Sensor::legs, "velocities of the joints", alike ? Check::Verdict::good : Check::Verdict::unknown, detail);
    diagnosis_.checks.back().at_rest = true;
    return;
  }
  Finding f{Sensor::legs, "joint_velocity", {}, detail, "the driver must publish rad/s, or no velocities at all", ratio, {}, {}, true};
  f.text = given == 0 ? "the messages of the legs have no velocities but zeros"
                      : fmt::format("the velocities of the joints are not rad/s: {:.3g} times what they should be", ratio);
  find(std::move(f));
}

// By acceleration alone, which soles that roll and joints that bend change by a few hundredths.
void Examination::examine_leg_size() {
  if (std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "leg_lengths"; })) return;
  const LegAcceleration& fit = leg_acceleration_;
  // On nine sound walks (levels 1 and 2) they seemed too long by 4 % at the most.
  constexpr double worth_it = 0.5, tolerance = 0.08;  // of the acceleration, -
  if (!fit.good || fit.explained < worth_it) {
    check(Sensor::legs, "lengths of the legs", Check::Verdict::unknown,
          fmt::format("no LiDAR whose way is known, and {:.0f} % of the legs' acceleration is the accelerometer's", 100 * fit.explained));
    return;
  }
  const std::string detail = fmt::format(
      "by their acceleration over standing soles the legs are {:.3f} to {:.3f} of the described size, standard "
      "deviation {:.3f}",
      1 / fit.most_scale, 1 / fit.least_scale, fit.scale_sigma);
  const double margin = std::max(tolerance, sure * fit.scale_sigma);
  if (margin > fit.least_scale) {
    check(Sensor::legs, "lengths of the legs", Check::Verdict::unknown, detail);
    return;
  }
  const bool longer = fit.least_scale > 1 + margin, shorter = fit.most_scale < 1 - margin;
  if (!longer && !shorter) {
    check(Sensor::legs, "lengths of the legs", Check::Verdict::good, detail);
    return;
  }
  const double scale = longer ? fit.least_scale : fit.most_scale;
  Finding f{Sensor::legs, "leg_lengths", {}, detail, {}, scale - 1, {}, {}, true};
  f.text = fmt::format("the legs of the URDF are too {}: by them the robot accelerates {:.2f} times as much as by the accelerometer",
                       longer ? "long" : "short", scale);
  f.remedy = "robot.urdf: the lengths of thigh and shin, or the URDF of this robot";
  find(std::move(f));
}

}  // namespace kilvo::lab
