// Legs without a LiDAR whose way is known: their acceleration over standing soles against the accelerometer's.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <numbers>
#include <tuple>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {
namespace {

/// Of a joint over a tenth of a second, rad: by its positions and by the velocities that came with them.
struct JointTurn {
  double by_position = 0, by_velocity = 0, seconds = 0;
};

struct JointTurns {
  std::size_t joint = 0;  // its place in the messages
  std::vector<JointTurn> turns;
};

std::vector<JointTurns> joint_turns(const std::vector<LegSample>& legs, const std::vector<std::size_t>& joints) {
  constexpr double longest = 0.03, span = 0.1;  // s: beyond is a gap; of a turn, over which jitter of stamps and encoders tells little
  std::vector<JointTurns> out;
  for (const std::size_t joint : joints) {
    out.push_back({joint, {}});
    double by_position = 0, by_velocity = 0;
    for (std::size_t k = 1, begin = 0; k < legs.size(); ++k) {
      const LegSample &a = legs[k - 1], &b = legs[k];
      const double dt = b.t - a.t;
      if (!(dt > 0 && dt < longest) || a.velocity.size() != a.position.size() || b.velocity.size() != b.position.size()) {
        begin = k, by_position = by_velocity = 0;
        continue;
      }
      by_position += std::remainder(b.position[joint] - a.position[joint], 2 * std::numbers::pi);  // of one that turns on and on
      by_velocity += 0.5 * (a.velocity[joint] + b.velocity[joint]) * dt;
      if (b.t - legs[begin].t < span) continue;
      out.back().turns.push_back({by_position, by_velocity, b.t - legs[begin].t});
      begin = k, by_position = by_velocity = 0;
    }
  }
  return out;
}

/// In how many of a joint's larger turns the velocities have the direction of the positions: positions that jump, and a wrong unit, change
/// little of that.
struct Directions {
  double count = 0, same = 0;
  Directions& operator+=(const Directions& other) {
    count += other.count, same += other.same;
    return *this;
  }
  double share() const { return same / count; }
  bool are_not_those_of_positions(double deviations) const {
    constexpr double least_share = 0.75;  // of sound ones 0.9 to 1, by chance 0.5
    return count > 0 && share() + deviations / 2 / std::sqrt(count) < least_share;
  }
};

Directions directions_of(const JointTurns& joint) {
  constexpr double least_rate = 0.1;  // rad/s, rms: below, noise decides
  double squares = 0, time = 0;
  for (const JointTurn& turn : joint.turns) squares += turn.by_position * turn.by_position, time += turn.seconds * turn.seconds;
  Directions out;
  if (!(time > 0) || squares < least_rate * least_rate * time) return out;
  for (const JointTurn& turn : joint.turns) {
    if (turn.by_position * turn.by_position * static_cast<double>(joint.turns.size()) < squares) continue;
    ++out.count;
    // Velocities within a dead band say nothing.
    if (turn.by_position * turn.by_velocity >= 0) out.same += turn.by_velocity == 0 ? 0.5 : 1;
  }
  return out;
}

constexpr double well = 0.95;  // of the acceleration

// Legs that are exchanged as a whole turn as they did: what is left by the acceleration is 0.2 to 0.5 of that before on seven walks.
bool explains_an_exchange(const LegAcceleration& exchanged, const LegAcceleration& described) {
  constexpr double half = 0.55, mostly = 0.8;
  return exchanged.explained > mostly && exchanged.differs() < half * described.differs();
}

}  // namespace

LegAcceleration Examination::leg_acceleration(const LegHypothesis* hypothesis, const SO3& R_link_imu, double offset) const {
  return leg_acceleration(legs_under(hypothesis), {mended_imu(), gyro()}, R_link_imu, offset);
}

LegAcceleration Examination::leg_acceleration(const std::vector<LegPose>& path, const MeasuredForce& force, const SO3& R_link_imu,
                                              double offset) const {
  // The acceleration is not what was measured.
  if (std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "accel_gravity"; })) return {};
  return fit_leg_acceleration(path, force, {R_link_imu, robot_.imu.T_link_imu.p}, offset);
}

// Joints and soles that turn as the gyro does, or hardly turn, may still not accelerate as the robot does. Where soles turn on the ground,
// and their turning tells nothing, the mount of the IMU and the clock show here as well.
bool Examination::try_acceleration_hypotheses() {
  const SO3 R = robot_.imu.T_link_imu.R;
  const auto of_gyro = [](const Finding& f) { return f.cause.starts_with("gyro") || f.cause == "imu_axes"; };
  const bool turning_is_hidden = !legs_.known && legs_.turned && std::ranges::none_of(diagnosis_.findings, of_gyro);
  // Feet that stand by the LiDAR's way tell more.
  if (!lidar_way().empty() && (!turning_is_hidden || feet_stand())) return false;
  const std::vector<LegPose> path = legs_under(nullptr);
  const MeasuredForce force(mended_imu(), gyro());
  const LegAcceleration described = leg_acceleration(path, force, R, leg_offset_);
  if (described.rows == 0 || described.explained > well) return false;
  if (turning_is_hidden && find_accelerated_mount(path, force, described)) return true;
  struct Candidate {
    const LegHypothesis* legs = nullptr;
    SO3 R;
    double offset = 0;
    LegAcceleration fit;
  };
  std::vector<LegHypothesis> all = leg_hypotheses(recorded_legs_, robot_);
  for (LegHypothesis& h : foot_link_hypotheses(recorded_legs_, robot_)) all.push_back(std::move(h));
  std::vector<Candidate> candidates;
  for (const LegHypothesis& h : all) {
    // The turning tells the link of the IMU better, if it tells anything.
    if (h.culprit == Sensor::legs || (turning_is_hidden && !turns_with_link(h))) candidates.push_back({&h, R, leg_offset_, {}});
  }
  if (turning_is_hidden) {
    constexpr int steps = 13;
    constexpr double step = 0.1;      // s, which the fit bridges
    constexpr std::size_t every = 3;  // of 36
    const std::vector<SO3> mounts = upright_mounts();
    for (std::size_t k = 0; k < mounts.size(); k += every) candidates.push_back({nullptr, mounts[k], leg_offset_, {}});
    for (int k = -steps; k <= steps && !recorded_.reading.leg_clock_is_found; ++k) {
      if (k * step != leg_offset_) candidates.push_back({nullptr, R, k * step, {}});
    }
  }
  const auto is_possible = [&](const Candidate& c) {
    // Many are tried: one that needs another mount besides fits by chance; soles that roll seem to turn the robot by 0.16.
    const double near = turning_is_hidden ? 0.2 : 0.1;  // rad
    // Of a robot that stands, or has walked for two seconds, no size is known.
    if (!c.fit.good || sure * c.fit.scale_sigma >= c.fit.least_scale || c.fit.turn.norm() >= near) return false;
    // What soles that roll make of right ones.
    constexpr double alone_tolerance = 0.2, alone_clock_tolerance = 0.025;  // rad, s
    if (c.legs == nullptr)
      return (c.R * R.inverse()).Log().norm() > alone_tolerance || std::abs(c.fit.offset - leg_offset_) > alone_clock_tolerance;
    // Another link is none that only moves as far.
    if (c.legs->cause == "foot_link" && c.fit.differs() > 1 - described.explained) return false;
    // What turns as the gyro does accelerates nearly as well.
    if (c.legs->cause == "joints_swapped") return explains_an_exchange(c.fit, described);
    return turning_is_hidden || c.fit.explained > well;
  };
  const Candidate* best = nullptr;
  for (Candidate& c : candidates) {
    c.fit = leg_acceleration(c.legs != nullptr ? legs_under(c.legs) : path, force, c.R, c.offset);
    if (c.legs == nullptr && c.offset == leg_offset_) std::tie(c.R, c.fit) = accelerated_mount(path, force, c.R, c.fit);
    constexpr double clearly = 0.9;  // of what the one before leaves, to take its place
    if (is_possible(c) && c.fit.differs() < (best == nullptr ? INFINITY : clearly * best->fit.differs())) best = &c;
  }
  if (best == nullptr) return false;
  const double then = best->fit.differs(), now = described.good ? described.differs() : 1;
  constexpr double most = 0.7, much_less = 0.65;
  if (then > most || then > much_less * now ||
      smaller_by(then, now, std::min(described.independent, best->fit.independent)) < sure_among(candidates.size())) {
    const bool is_of_legs = best->legs != nullptr ? best->legs->culprit == Sensor::legs : best->offset != leg_offset_;
    // Where the LiDAR knows its way, the legs' way is still to be held against it.
    if (then < much_less * now && lidar_way().empty()) seems_wrong(is_of_legs ? Sensor::legs : Sensor::imu) = true;
    return false;
  }
  const std::string evidence = fmt::format(
      "the acceleration of the legs over standing soles differs from the accelerometer's by {:.2f} of its square then, by {:.2f} as "
      "described",
      then, now);
  if (best->legs != nullptr) {
    find_on_legs({best->legs->culprit, best->legs->cause, best->legs->name, evidence, best->legs->setting, 0, {}, {}, true}, *best->legs);
  } else if (best->offset != leg_offset_) {
    leg_offset_ = best->fit.offset;
    find_offset(Sensor::legs, leg_offset_, best->fit.offset_sigma, evidence);
  } else {
    find_turned_imu((best->R.inverse() * SO3::Exp(best->fit.turn)).inverse(), evidence);
  }
  return true;
}

// The velocities that the messages give against the change of the positions that they come with.
void Examination::examine_joint_speeds() {
  if (robot_.legs.velocities != "messages") return;
  const std::vector<std::size_t> joints = recorded_legs_.joints_that_matter(robot_);
  const std::vector<JointTurns> turns = joint_turns(recorded_.legs, joints);
  double both = 0, turned = 0, given = 0, time = 0;
  Directions all;
  const JointTurns* other = nullptr;  // whose velocity is another one's
  for (const JointTurns& joint : turns) {
    for (const JointTurn& turn : joint.turns) {
      both += turn.by_position * turn.by_velocity;
      turned += turn.by_position * turn.by_position;
      given += turn.by_velocity * turn.by_velocity;
      time += turn.seconds * turn.seconds;
    }
    const Directions own = directions_of(joint);
    all += own;
    if (own.are_not_those_of_positions(sure_among(joints.size()))) other = &joint;
  }
  constexpr double least_rate = 0.1, least_ratio = 0.5, most_ratio = 2;  // rad/s, -: filters of a driver take less
  if (!(time > 0) || turned < least_rate * least_rate * time) return;
  const double ratio = both / turned;
  std::string detail = fmt::format("the velocities are {:.3g} times the change of the positions", ratio);
  // Positions that jump differ by more than any velocity.
  constexpr double clearly = 0.5;  // squared correlation
  const bool alike = both * both > clearly * turned * given, is_ratio = ratio > least_ratio && ratio < most_ratio;
  const bool follow = other == nullptr && !all.are_not_those_of_positions(sure);
  if (given > 0 && follow && (!alike || is_ratio)) {
    check(Sensor::legs, "velocities of the joints", alike ? Check::Verdict::good : Check::Verdict::unknown, detail);
    diagnosis_.checks.back().at_rest = true;
    return;
  }
  if (!follow) {
    const Directions worst = other != nullptr ? directions_of(*other) : all;
    detail = fmt::format("{} in {:.0f} % of {} turns they have the direction in which the positions change",
                         other != nullptr ? recorded_.joint_names[other->joint] + ":" : "of all joints", 100 * worst.share(), worst.count);
  }
  Finding f{Sensor::legs, "joint_velocity", {}, detail, "the driver must publish rad/s, or legs.velocities: positions", ratio, {}, {},
            true};
  f.text = given == 0 ? "the messages of the legs have no velocities but zeros"
           : follow   ? fmt::format("the velocities of the joints are not rad/s: {:.3g} times what they should be", ratio)
                      : "the velocities of the joints do not follow their positions";
  f.changes = {{"legs.velocities", "positions"}};
  speeds_contradict_ = !follow;
  find(std::move(f));
}

void Examination::settle_joint_speeds() {
  auto& all = diagnosis_.findings;
  const auto of_positions = [](const Finding& f) { return f.cause.starts_with("joint") && f.cause != "joint_velocity"; };
  const auto wrong = std::ranges::find_if(all, of_positions);
  if (!speeds_contradict_ || wrong == all.end()) return;
  if (!wrong->changes.empty()) wrong->changes.push_back({"legs.velocities", "positions"});
  std::erase_if(all, [](const Finding& f) { return f.cause == "joint_velocity"; });
}

// By acceleration alone, which soles that roll and joints that bend change by a few hundredths.
void Examination::examine_leg_size() {
  if (std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "leg_lengths"; })) return;
  const LegAcceleration& fit = leg_acceleration_;
  // On twelve sound walks, from five times on each, they seemed too long by 12 % at the most (square_walk 36, level 2, from 22 s on).
  constexpr double worth_it = 0.5, tolerance = 0.15;  // of the acceleration, -
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
