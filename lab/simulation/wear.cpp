#include "lab/simulation/wear.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kilvo::lab {
namespace {

enum WearStream : std::uint8_t { link_stream = 40, shock_stream, jitter_stream, imu_loss_stream, leg_loss_stream, tone_stream };

// Crossing the play of a joint takes this long, s.
constexpr double crossing = 0.005;
// A torque below this presses to no side, N m.
constexpr double least_torque = 0.5;
// A shock lasts about so long, s; a joint's part of it acts over this arm, m.
constexpr double shock_time = 0.006, arm = 0.5;

}  // namespace

BipedShape built(BipedShape nominal, const WearModel& model, std::uint64_t seed) {
  if (model.link_length == 0) return nominal;
  Random random(seed, link_stream);
  nominal.thigh *= 1 + model.link_length * random.gaussian();
  nominal.shin *= 1 + model.link_length * random.gaussian();
  return nominal;
}

std::vector<Stage> on_soft_soles(std::vector<Stage> stages, const WearModel& model) {
  for (Stage& stage : stages) {
    stage.gait.creep += model.sole_motion;
    stage.gait.sink += model.sole_motion / 3;
    if (model.impact > 0) stage.gait.impact = model.impact;
  }
  return stages;
}

Wear::Wear(const WearModel& model, const Walk& walk, std::uint64_t seed)
    : model_(model),
      walk_(walk),
      shock_(seed, shock_stream),
      jitter_(seed, jitter_stream),
      loss_{Random(seed, imu_loss_stream), Random(seed, leg_loss_stream)} {
  for (std::size_t i = 0; i < 2; ++i) {
    for (const Footprint& print : walk.plan().prints[i]) touchdowns_[i].push_back(print.touch);
  }
  Random random(seed, tone_stream);
  for (auto& axis : tones_) {
    for (Tone& tone : axis) tone = {random.uniform(45, 90), random.uniform(0, 2 * std::numbers::pi)};
  }
}

// Where in its play a joint is pressed to, from -1 to 1.
double Wear::slack(std::size_t joint, double effort, double dt) {
  const double to = effort > least_torque ? 1 : effort < -least_torque ? -1 : side_[joint];
  const double before = side_[joint];
  side_[joint] += std::clamp(to - before, -2 * dt / crossing, 2 * dt / crossing);
  return side_[joint] - before;
}

// Velocities that a leg's encoders show just after its touchdown, and the links have not.
JointAngles Wear::shocks(double t) {
  JointAngles out{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto next = std::ranges::upper_bound(touchdowns_[i], t);
    if (next == touchdowns_[i].begin()) continue;
    const double since = t - *std::prev(next);
    if (!(since < 3 * shock_time)) continue;
    for (std::size_t k = 0; k < leg_joint_count; ++k) {
      out[i * leg_joint_count + k] = model_.shock / arm * std::exp(-since / shock_time) * shock_.gaussian();
    }
  }
  return out;
}

Wear::Encoders Wear::encoders(double t, const JointAngles& velocities, const JointAngles& efforts) {
  Encoders out;
  const bool first = last_ < 0;
  const double dt = first ? 0 : t - last_;
  last_ = t;
  for (std::size_t k = 0; k < velocities.size(); ++k) {
    if (model_.backlash > 0) {
      const double moved = first ? (side_[k] = efforts[k] < 0 ? -1 : 1, 0.0) : slack(k, efforts[k], dt);
      out.angle[k] += model_.backlash / 2 * side_[k];
      if (dt > 0) out.velocity[k] += model_.backlash / 2 * moved / dt;
    }
    if (model_.flex > 0) {
      const double flexed = model_.flex * efforts[k] / 100;
      out.angle[k] -= flexed;
      if (dt > 0) out.velocity[k] -= (flexed - flexed_[k]) / dt;
      flexed_[k] = flexed;
    }
  }
  if (model_.shock > 0) {
    const JointAngles jolt = shocks(t);
    for (std::size_t k = 0; k < jolt.size(); ++k) out.velocity[k] += jolt[k];
  }
  if (model_.velocity_lag > 0) {
    const double share = first ? 1 : 1 - std::exp(-dt / model_.velocity_lag);
    for (std::size_t k = 0; k < velocities.size(); ++k) {
      slow_[k] += share * (velocities[k] + out.velocity[k] - slow_[k]);
      out.velocity[k] = slow_[k] - velocities[k];
    }
  }
  return out;
}

Eigen::Vector3d Wear::vibration(double t) const {
  const auto& steps = walk_.plan().steps;
  if (model_.vibration == 0 || steps.empty() || t < steps.front().begin || t > walk_.end()) return Eigen::Vector3d::Zero();
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    for (const Tone& tone : tones_[static_cast<std::size_t>(axis)]) {
      out[axis] += std::sin(2 * std::numbers::pi * tone.frequency * t + tone.phase);
    }
  }
  return model_.vibration * std::sqrt(2.0 / static_cast<double>(tones_[0].size())) * out;
}

Copies Wear::copies(Sensor sensor) {
  if (sensor != Sensor::imu && sensor != Sensor::legs) return Copies::one;
  const bool legs = sensor == Sensor::legs;
  const double lost = model_.lost + (legs ? model_.legs_lost : 0), repeated = model_.repeated + (legs ? model_.legs_repeated : 0);
  if (lost == 0 && repeated == 0) return Copies::one;
  const double drawn = loss_[legs ? 1 : 0].uniform();
  return drawn < lost ? Copies::none : drawn > 1 - repeated ? Copies::two : Copies::one;
}

Time Wear::joint_stamp(Time ideal) {
  if (model_.stamp_jitter == 0) return ideal;
  last_stamp_ = std::max(last_stamp_, ideal + from_seconds(model_.stamp_jitter * jitter_.gaussian()));
  return last_stamp_;
}

}  // namespace kilvo::lab
