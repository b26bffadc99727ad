#include "lab/simulation/scenarios.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "lab/simulation/units.hpp"

namespace kilvo::lab {
namespace {

constexpr double quarter = std::numbers::pi / 2;
// The robot stands 3 s; the last 0.4 s before the first step the pelvis begins to move.
constexpr double first_stand = 3.4;

Stage stand(double seconds) { return {.stand = seconds}; }
Stage ahead(int steps, double length, Gait gait = {}) {
  gait.forward = length;
  return {.steps = steps, .gait = gait};
}
Stage aside(int steps, double length, Gait gait = {}) {
  gait.left = length;
  return {.steps = steps, .gait = gait};
}
// A turn by `angle` while going forward.
Stage turn(int steps, double angle, double length = 0, Gait gait = {}) {
  gait.turn = angle / steps;
  return ahead(steps, length, gait);
}

Gait fast() {
  return {.period = 0.42,
          .double_support = 0.06,
          .lift = 0.07,
          .hip_height = 0.54,
          .sway = 0.02,
          .bob = 0.015,
          .twist = 0.08,
          .lean = 0.06,
          .leaving = 0.4,
          .landing = 0.4,
          .impact = 8};
}
Gait running() {
  return {.period = 0.36,
          .double_support = -0.08,
          .lift = 0.09,
          .hip_height = 0.53,
          .sway = 0.012,
          .bob = -0.028,
          .roll = 0.015,
          .pitch = 0.01,
          .twist = 0.1,
          .lean = 0.1,
          .impact = 12};
}
Gait climbing() {
  return {.period = 0.7,
          .double_support = 0.16,
          .lift = 0.03,
          .hip_height = 0.515,
          .sway = 0.03,
          .bob = 0.006,
          .lean = 0.06,
          .leaving = 0.28,
          .landing = 0.3,
          .impact = 5,
          .toe_off = 0.3};
}
Gait descending() {
  Gait gait = climbing();
  gait.hip_height = 0.49;
  return gait;
}
Gait rolling() { return {.hip_height = 0.54, .heel_strike = 0.18, .toe_off = 0.3}; }
Gait slipping() { return {.slip = 0.03}; }
Gait sinking() { return {.impact = 2, .sink = 0.012, .creep = 0.003}; }
// Loose slabs: each gives way a little and shifts sideways under the foot.
Gait on_tiles() { return {.hip_height = 0.545, .impact = 6, .sink = 0.005, .creep = 0.01}; }
// From a run to a stand within one step.
Gait stopping() { return {.period = 0.45, .double_support = 0.12, .lift = 0.05, .hip_height = 0.52, .sway = 0.01, .impact = 8}; }
// One foot after the other is held up.
Gait lifting() { return {.period = 1.8, .double_support = 0.5, .lift = 0.1, .leaving = 0.15, .landing = 0.15, .impact = 2}; }

// As robots are after some time of use: leg lengths and zeros not as the URDF says, play and give, shocks, messages that get lost.
WearModel well_used() {
  return {.sole_motion = 0.01,
          .shock = 0.1,
          .impact = 8,
          .flex = 1.2 * degree,
          .backlash = 0.15 * degree,
          .zero_offset = 0.3 * degree,
          .link_length = 0.005,
          .velocity_lag = 0.003,
          .stamp_jitter = 3e-4,
          .lost = 0.005,
          .repeated = 0.002,
          .vibration = 1};
}
// The same at 50 Hz, from an IMU without a filter before it.
WearModel well_used_and_slow() {
  WearModel out = well_used();
  out.vibration = 5;
  out.stamp_jitter = 0.002;
  return out;
}

Scenario named_also(std::string name, Scenario scenario) {
  scenario.also = std::move(name);
  return scenario;
}

// Steps and quarter turns about a rectangle.
std::vector<Stage> square(int rounds, const Gait& gait, double length) {
  std::vector<Stage> out{stand(first_stand)};
  for (int i = 0; i < 2 * rounds; ++i) {
    out.push_back(ahead(8, length, gait));
    out.push_back(turn(6, quarter, 0.1, gait));
    out.push_back(ahead(5, length, gait));
    out.push_back(turn(6, quarter, 0.1, gait));
  }
  out.push_back(stand(1));
  return out;
}

const Place room_corner{-2.2, -1.3, 0};

std::vector<Scenario> of_the_room() {
  const Stage still = stand(first_stand), rest = stand(1);
  return {
      named_also("room_short",
                 {"room", "forward and turning through a furnished room, 30 s", "room", room_corner, square(1, {.forward = 0}, 0.27)}),
      {"stand", "standing still", "room", room_corner, {stand(20)}},
      named_also("walk_in_place", {"in_place", "stepping on the spot", "room", {-0.5, 0, 0}, {still, ahead(30, 0), rest}}),
      {"forward", "straight ahead", "room", {-3.4, 0.3, 0}, {still, ahead(24, 0.26), rest}},
      named_also("walk_back", {"backward", "straight back", "room", {2.8, 0.3, 0}, {still, ahead(26, -0.2), rest}}),
      {"fwd_bwd",
       "forward and back, twice",
       "room",
       {-2.4, 0.3, 0},
       {still, ahead(14, 0.25), stand(0.5), ahead(14, -0.2), stand(0.5), ahead(12, 0.25), stand(0.5), ahead(14, -0.2), rest}},
      {"sideways", "to the left and back to the right", "room", {0, -2, 0}, {still, aside(20, 0.1), stand(0.5), aside(20, -0.1), rest}},
      {"spin",
       "turning on the spot, one turn each way",
       "room",
       {-0.5, 0, 0},
       {still, turn(24, 4 * quarter), stand(0.5), turn(24, -4 * quarter), rest}},
      named_also("square_walk", {"square", "two rounds of a rectangle", "room", room_corner, square(2, {}, 0.27)}),
      {"hour", "a rectangle again and again, for an hour", "room", room_corner, square(121, {}, 0.27)},
      {"lifts", "one foot is held up after the other", "room", {-0.5, 0, 0}, {still, ahead(12, 0, lifting()), rest}},
      {"fast_walk", "long quick steps round a room", "room", room_corner, square(2, fast(), 0.32)},
      {"rolling", "soles that come down on the heel and leave over the toe", "room", room_corner, square(1, rolling(), 0.3)},
      {"slip", "the left foot slides 3 cm in every stance", "room", room_corner, square(1, slipping(), 0.24)},
      {"worn", "round a room on legs that are not as the URDF says, on soles that give way", "room", room_corner, square(1, {}, 0.25), 0,
       well_used(), 500},
      {"worn_slow", "the same with joints and an unfiltered IMU at 50 Hz", "room", room_corner, square(1, {}, 0.25), 0,
       well_used_and_slow(), 50, 50},
      named_also("soft_terrain",
                 {"soft", "a floor into which the feet sink and on which they creep", "room", room_corner, square(1, sinking(), 0.25)}),
      {"run_room",
       "running up and down a room, with both feet in the air between steps",
       "room",
       {-2.6, -1.2, 0},
       {still, ahead(2, 0.25, fast()), ahead(8, 0.42, running()), ahead(3, 0.15, fast()), turn(12, 2 * quarter, 0.05, fast()),
        ahead(8, 0.42, running()), ahead(3, 0.15, fast()), turn(12, 2 * quarter, 0.05, fast()), ahead(8, 0.42, running()),
        ahead(3, 0.15, fast()), rest}},
  };
}

std::vector<Scenario> of_elsewhere() {
  const Stage still = stand(first_stand), rest = stand(1);
  const Stage about = turn(12, 2 * quarter);
  std::vector<Scenario> out{
      {"corridor",
       "40 m of corridor, without LiDAR information along it in the middle",
       "corridor",
       {0, 0, 0},
       {still, ahead(110, 0.32, fast()), rest},
       9},
      {"corridor_blank",
       "20 m of a corridor, without LiDAR information along it in the middle and without texture on its walls",
       "corridor_blank",
       {0, 0, 0},
       {still, ahead(62, 0.32, fast()), rest},
       9},
      {"blank_wall",
       "up to a wall without texture, along it, and back",
       "blank_wall",
       {1.2, -1, 0},
       {still, ahead(12, 0.25), stand(0.5), aside(20, 0.1), stand(0.5), ahead(12, -0.2), rest}},
      named_also("outdoor", {"yard",
                             "over a ramp, round, back, and over boards",
                             "yard",
                             {-1, 0.6, 0},
                             {still, ahead(44, 0.27, {.hip_height = 0.53}), about, ahead(40, 0.27, {.hip_height = 0.53}), turn(8, quarter),
                              ahead(9, 0.2, {.hip_height = 0.54}), turn(8, quarter), ahead(8, 0.2, {.hip_height = 0.54}), rest}}),
      {"robust",
       "over a ramp, a spin, a fast walk, soft soil, backwards, a foot held up, and back",
       "yard",
       {-1, 0.6, 0},
       {still, ahead(44, 0.27, {.hip_height = 0.53}), turn(24, 4 * quarter), about, ahead(40, 0.27, {.hip_height = 0.53}),
        ahead(8, 0.3, fast()), stand(1), ahead(8, -0.2), ahead(8, 0.2, sinking()), about, ahead(4, 0, lifting()), ahead(6, 0.25), rest}},
      {"tiles", "over slabs that give way and shift", "yard", {-14, -4.5, 0}, {still, ahead(50, 0.25, on_tiles()), rest}},
      {"slope", "up a ramp and down its other side", "yard", {0.4, 0, 0}, {still, ahead(38, 0.27, {.hip_height = 0.53}), rest}},
      {"run",
       "running over grass, with both feet in the air between steps",
       "yard",
       {-14, -4.5, 0},
       {still, ahead(4, 0.3, fast()), ahead(36, 0.44, running()), ahead(4, 0.2, fast()), rest}},
      {"emergency_stop",
       "running, and to a stand within one step, three times",
       "yard",
       {-14, -4.5, 0},
       {still, ahead(4, 0.3, fast()), ahead(10, 0.44, running()), ahead(1, 0.15, stopping()), stand(2), ahead(4, 0.3, fast()),
        ahead(8, 0.44, running()), ahead(1, 0.15, stopping()), stand(2), ahead(4, 0.3, fast()), ahead(6, 0.44, running()),
        ahead(1, 0.15, stopping()), stand(2)}},
      {"stairs",
       "six stairs up, a turn, and down again",
       "stairs",
       {-0.02, 0, 0},
       {still, ahead(3, 0.28, climbing()), ahead(11, 0.28, climbing()), turn(14, 2 * quarter, 0, climbing()), ahead(14, 0.28, descending()),
        rest}},
  };
  return out;
}

}  // namespace

const std::vector<Scenario>& scenarios() {
  static const std::vector<Scenario> all = [] {
    std::vector<Scenario> out = of_the_room();
    for (Scenario& s : of_elsewhere()) out.push_back(std::move(s));
    return out;
  }();
  return all;
}

const Scenario* find_scenario(std::string_view name) {
  const auto found = std::ranges::find_if(scenarios(), [name](const Scenario& s) { return s.name == name || s.also == name; });
  return found == scenarios().end() ? nullptr : &*found;
}

SimulatorConfig robot_of(const Scenario& scenario) {
  SimulatorConfig config;
  config.wear = scenario.wear;
  if (scenario.leg_rate > 0) config.joints.delivery.rate = scenario.leg_rate;
  if (scenario.imu_rate > 0) config.imu.delivery.rate = scenario.imu_rate;
  return config;
}

}  // namespace kilvo::lab
