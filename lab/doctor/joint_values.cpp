// What the positions of the joints show without the lengths and axes of the description: joints that never turn, joints that show another's
// angle.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <fmt/format.h>
#include <map>
#include <regex>
#include <stdexcept>

#include "kilvo/math/running_statistics.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {
namespace {

constexpr double at_rest = 1e-3;  // rad: no joint of a leg that walks turns by less in all
constexpr double turns = 0.05;    // rad

struct Range {
  double low = INFINITY, high = -INFINITY;
  double size() const { return high - low; }
};

// Of so many joints; messages with fewer positions than names say nothing.
std::vector<Range> ranges_of(const std::vector<LegSample>& legs, std::size_t joints) {
  std::vector<Range> out(joints);
  for (const LegSample& s : legs) {
    for (std::size_t i = 0; s.position.size() == joints && i < joints; ++i)
      out[i] = {std::min(out[i].low, s.position[i]), std::max(out[i].high, s.position[i])};
  }
  return out;
}

// Of the last seconds in which a joint stood still, those in which the robot walked and the joints of `walking` turned.
double seconds_stuck(const std::vector<LegSample>& legs, std::size_t joint, const std::vector<std::size_t>& walking,
                     const Stepping& stepping) {
  if (legs.empty()) return 0;
  Range still;
  std::vector<Range> of_second(walking.size());
  double end = legs.back().t, stuck = 0;
  for (auto s = legs.rbegin(); s != legs.rend(); ++s) {
    if (s->position.size() <= std::max(joint, std::ranges::max(walking))) continue;
    still = {std::min(still.low, s->position[joint]), std::max(still.high, s->position[joint])};
    if (still.size() >= at_rest) break;
    for (std::size_t k = 0; k < walking.size(); ++k)
      of_second[k] = {std::min(of_second[k].low, s->position[walking[k]]), std::max(of_second[k].high, s->position[walking[k]])};
    if (end - s->t < 1) continue;
    constexpr double gap = 1.1;  // s
    const bool walks =
        s->t > stepping.begin && end < stepping.end && std::ranges::all_of(of_second, [](const Range& r) { return r.size() > turns; });
    if (walks && end - s->t < gap) stuck += end - s->t;
    end = s->t;
    of_second.assign(walking.size(), {});
  }
  return stuck;
}

// Standard deviation of a joint's position, rad.
double spread_of(const std::vector<LegSample>& legs, std::size_t joint) {
  RunningStatistics out(0, 0, 0, INFINITY);
  for (const LegSample& s : legs) {
    if (joint < s.position.size()) out.add(s.position[joint], 1);
  }
  return out.sigma();
}

// Those of these names that are fixed turn instead.
std::string with_joints_that_turn(const std::string& urdf, const std::vector<std::string>& names) {
  std::string out = urdf;
  const std::regex name("\\sname\\s*=\\s*[\"']([^\"']+)[\"']"), fixed("\\stype\\s*=\\s*[\"']fixed[\"']");
  for (std::size_t at = 0; (at = out.find("<joint", at)) != std::string::npos; ++at) {
    const std::size_t end = std::min(out.find('>', at), out.size());
    const std::string tag = out.substr(at, end - at);
    std::smatch found;
    if (!std::regex_search(tag, found, name) || std::ranges::find(names, found[1].str()) == names.end()) continue;
    out.replace(at, end - at, std::regex_replace(tag, fixed, " type=\"revolute\""));
  }
  return out;
}

bool same_values(const std::vector<LegSample>& legs, std::size_t a, std::size_t b) {
  return std::ranges::all_of(legs,
                             [&](const LegSample& s) { return s.position.size() <= std::max(a, b) || s.position[a] == s.position[b]; });
}

}  // namespace

// A joint of the legs that is described as locked, and turns.
void Examination::examine_locked_joints() {
  Robot unlocked = robot_;
  unlocked.locked_joints.clear();
  const std::vector<std::size_t> joints = recorded_legs_.joints_that_matter(unlocked);
  std::string moved;
  std::vector<std::string> kept;
  double most = 0;
  for (const std::string& joint : robot_.locked_joints) {
    const auto i = static_cast<std::size_t>(std::ranges::find(recorded_.joint_names, joint) - recorded_.joint_names.begin());
    const double spread = spread_of(recorded_.legs, i);
    if (std::ranges::find(joints, i) == joints.end() || spread < 0.5 * turns) {
      kept.push_back(joint);
      continue;
    }
    moved += (moved.empty() ? "" : ", ") + joint;
    most = std::max(most, spread);
  }
  if (moved.empty()) return;
  robot_.locked_joints = kept;
  const std::string list = fmt::format("[{}]", fmt::join(kept, ", "));
  find({Sensor::legs,
        "joint_locked",
        fmt::format("described as locked, and they turn: {}", moved),
        fmt::format("standard deviation of up to {:.2f} rad in the messages", most),
        "robot.locked_joints: " + list,
        most,
        "rad",
        {{"robot.locked_joints", list}},
        true});
}

// Joints that nothing measures and that are taken not to move are the first to look at where the legs do not fit.
void Examination::suspect_locked_joints() {
  if (robot_.locked_joints.empty() || robot_.urdf.empty() || recorded_.legs.empty()) return;
  Robot unlocked = robot_;
  unlocked.locked_joints.clear();
  std::vector<std::string> locked;
  try {
    const auto measured = recorded_legs_.names_of_joints(robot_);
    for (const auto& [joint, name] : recorded_legs_.names_of_joints(unlocked)) {
      if (!measured.contains(joint)) locked.push_back(joint);
    }
  } catch (const std::invalid_argument&) {
    return;  // the URDF is none
  }
  if (locked.empty()) return;
  const std::string suspects = fmt::format("look first whether these move: robot.locked_joints {}", fmt::join(locked, ", "));
  for (Finding& f : diagnosis_.findings) {
    const bool by_legs = f.sensor == Sensor::legs && !f.cause.ends_with("_clock") && !f.cause.ends_with("_rate");
    if (by_legs || f.cause.starts_with("imu_mount") || f.cause == "imu_link") f.remedy = suspects + "; else " + f.remedy;
  }
  for (Check& c : diagnosis_.checks) {
    if (c.verdict == Check::Verdict::unknown && (c.sensor == Sensor::legs || c.what.find("mount on the robot") != std::string::npos))
      c.detail += "; " + suspects;
  }
}

// A joint that the URDF has as fixed (a waist that can be locked, a description that was made simpler for training), and turns. False: it
// is a joint of the legs, which cannot be judged then.
bool Examination::examine_fixed_joints() {
  Robot free = robot_;
  free.urdf = with_joints_that_turn(robot_.urdf, recorded_.joint_names);
  if (free.urdf == robot_.urdf) return true;
  const std::vector<std::size_t> described = recorded_legs_.joints_that_matter(robot_);
  std::string turning;
  double most = 0;
  for (const std::size_t i : recorded_legs_.joints_that_matter(free)) {
    const double spread = spread_of(recorded_.legs, i);
    if (std::ranges::find(described, i) != described.end() || spread < 0.5 * turns) continue;
    turning += (turning.empty() ? "" : ", ") + recorded_.joint_names[i];
    most = std::max(most, spread);
  }
  if (turning.empty()) return true;
  find({Sensor::legs,
        "joint_fixed",
        fmt::format("fixed in the URDF, and they turn: {}", turning),
        fmt::format("standard deviation of up to {:.2f} rad in the messages", most),
        "robot.urdf: the URDF of the robot as it is built, in which they are revolute",
        most,
        "rad",
        {},
        true});
  return false;
}

// A second publisher on the topic (the zeros of a joint_state_publisher, a simulation beside the robot), or an encoder that fails. Not of
// positions in degrees, whose noise may be as large.
bool Examination::joints_jump() {
  constexpr std::size_t fewest = 10;
  constexpr double rare = 1e-3, few = 0.01;  // of the messages; with a few the legs can be judged all the same
  const auto has_unit = [](const Finding& f) { return f.cause == "joint_unit"; };
  if (std::ranges::any_of(diagnosis_.findings, has_unit)) return false;
  std::size_t joint = 0, count = 0;
  for (const std::size_t i : recorded_legs_.joints_that_matter(robot_)) {
    if (i >= recorded_.joint_returns.size() || recorded_.joint_returns[i].count <= count) continue;
    count = recorded_.joint_returns[i].count;
    joint = i;
  }
  const double share = static_cast<double>(count) / std::max(1.0, static_cast<double>(recorded_.joint_messages));
  if (count < fewest || share < rare) return false;
  find(
      {Sensor::legs,
       "joints_jump",
       fmt::format("joints jump and are back in the next message: {} of {} messages", count, recorded_.joint_messages),
       fmt::format("{} by up to {:.2f} rad", recorded_.joint_names[joint], recorded_.joint_returns[joint].largest),
       "only the robot's encoders may publish on the topic of the joints: look for another publisher (joint_state_publisher, a simulation)",
       share,
       "of the messages",
       {},
       share > few});
  return share > few;
}

// An encoder that slips or loses its zero, a gear that jumps a tooth.
void Examination::find_joint_slip() {
  constexpr double least = 0.1;  // rad
  constexpr std::ptrdiff_t most_steps = 2;
  constexpr std::size_t most_of_all = 6;
  constexpr double longest = 0.0055;  // s: of slower messages a step of a walk is as large (T1, 50 Hz: 0.5 rad)
  if (!(recorded_.stamps[static_cast<std::size_t>(Sensor::legs)].period < longest)) return;
  if (recorded_.joint_steps.size() > most_of_all) return;
  std::map<std::size_t, JointStep> sums;
  for (const JointStep& step : recorded_.joint_steps) {
    JointStep& sum = sums.try_emplace(step.joint, JointStep{step.t, step.joint, 0}).first->second;
    sum.size += step.size;
  }
  for (const std::size_t joint : recorded_legs_.joints_that_matter(robot_)) {
    const auto sum = sums.find(joint);
    // What steps again and again is an encoder that is read less often than its messages come.
    if (std::ranges::count(recorded_.joint_steps, joint, &JointStep::joint) > most_steps) continue;
    if (sum == sums.end() || std::abs(sum->second.size) < least) continue;
    const double size = sum->second.size;
    find({Sensor::legs,
          "joint_slip",
          fmt::format("the position of {} has jumped by {:.2f} rad and stays there", recorded_.joint_names[joint], size),
          fmt::format("from one message to the next, {:.1f} s after the first one that was looked at, and no other joint",
                      sum->second.t - recorded_.legs.front().t),
          "the encoder or its coupling; until then robot.joints with another zero of that joint",
          size,
          "rad",
          {},
          true});
    return;
  }
}

// False when the legs cannot be judged with these values.
bool Examination::examine_joint_values() {
  if (joints_jump()) return false;
  if (!recorded_.legs.empty()) find_joint_slip();
  const std::vector<std::size_t> joints = recorded_legs_.joints_that_matter(robot_);
  const std::vector<Range> ranges = ranges_of(recorded_.legs, recorded_.joint_names.size());
  const std::vector<std::string>& names = recorded_.joint_names;
  const LegSides sides = recorded_legs_.sides(robot_);
  std::string frozen, stuck, repeated;
  constexpr double no_chance = 5;  // s, for which no joint of a leg that walks stands still
  // Of the other joints of its leg.
  const auto most_moving_beside = [&](std::size_t i) {
    std::size_t out = i;
    for (const std::size_t k : joints) {
      if (k != i && sides.leg_of_joint(names[k]) == sides.leg_of_joint(names[i]) && (out == i || ranges[k].size() > ranges[out].size()))
        out = k;
    }
    return out;
  };
  const auto add = [](std::string& to, const std::string& text) { to += (to.empty() ? "" : ", ") + text; };
  for (const std::size_t i : joints) {
    const auto twin = std::ranges::find(names, sides.other_joint(names[i])) - names.begin();
    const auto j = static_cast<std::size_t>(twin);
    if (j == names.size() || j == i || i >= names.size()) continue;
    // The same joint of the other leg walks.
    if (ranges[i].size() < at_rest && ranges[j].size() > turns) {
      add(frozen, names[i]);
    } else if (const double s = seconds_stuck(recorded_.legs, i, {j, most_moving_beside(i)}, stepping_); s > no_chance) {
      add(stuck, fmt::format("{} for {:.0f} s of walking", names[i], s));
    }
    if (i < j && ranges[i].size() > turns && same_values(recorded_.legs, i, j)) add(repeated, names[i] + " and " + names[j]);
  }
  const std::string driver = "the driver must publish each position under its own joint's name";
  if (!frozen.empty() || !stuck.empty()) {
    find({Sensor::legs,
          "joint_frozen",
          stuck.empty() ? fmt::format("the positions of {} never change", frozen)
                        : fmt::format("the positions have not changed at the end: {}{}{}", stuck, frozen.empty() ? "" : ", never ", frozen),
          "the same joint of the other leg turns",
          driver,
          0,
          "",
          {},
          true});
  }
  if (!repeated.empty()) {
    find({Sensor::legs,
          "joints_repeated",
          fmt::format("the positions are the same in both legs: {}", repeated),
          fmt::format("all {} samples", recorded_.legs.size()),
          driver,
          0,
          "",
          {},
          true});
  }
  return frozen.empty() && repeated.empty();
}

}  // namespace kilvo::lab
