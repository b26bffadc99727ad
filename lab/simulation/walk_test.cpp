#include "lab/simulation/walk.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <set>

#include "lab/simulation/joint_effort.hpp"
#include "lab/simulation/random.hpp"
#include "lab/simulation/scenarios.hpp"
#include "lab/simulation/world.hpp"

namespace kilvo::lab {
namespace walk_test {

using ::testing::HasSubstr;

const Scenario& scenario(const std::string& name) { return *std::ranges::find(scenarios(), name, &Scenario::name); }

Walk walk_of(const std::string& name) {
  const Scenario& s = scenario(name);
  return {BipedShape{}, make_scene(s.world, 1).ground, s.start, s.stages};
}

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

struct Integrated {
  double position, attitude;  // errors, m and degrees
};

// Integrates gyro and accelerometer from the true state at `begin` and compares after five seconds. Between samples both are linear.
Integrated integrate(const Walk& walk, double begin, double rate) {
  const Eigen::Vector3d gravity(0, 0, -9.80665);
  constexpr double lasts = 5;
  const double dt = 1 / rate;
  SE3 T = walk.imu(begin);
  Eigen::Vector3d v = walk.velocity(begin);
  const auto force = [&](double t) { return Eigen::Vector3d(walk.imu(t).R.inverse() * (walk.acceleration(t) - gravity)); };
  Eigen::Vector3d w0 = walk.angular_rate(begin), f0 = force(begin);
  const int n = static_cast<int>(std::lround(lasts * rate));
  for (int i = 1; i <= n; ++i) {
    const double t = begin + i * dt;
    const Eigen::Vector3d w1 = walk.angular_rate(t), f1 = force(t);
    const SO3 next = T.R * SO3::Exp((w0 + w1) / 2 * dt + w0.cross(w1) * dt * dt / 12);
    const Eigen::Vector3d a0 = T.R * f0 + gravity, a1 = next * f1 + gravity;
    T.p += v * dt + (2 * a0 + a1) / 6 * dt * dt;
    v += (a0 + a1) / 2 * dt;
    T.R = next;
    w0 = w1;
    f0 = f1;
  }
  const SE3 truth = walk.imu(begin + lasts);
  return {(T.p - truth.p).norm(), degrees((truth.R.inverse() * T.R).Log().norm())};
}

class EveryWalk : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryWalk, AnImuWithoutNoiseIntegratesToTheTruth) {
  const Walk walk = walk_of(GetParam());
  for (const double begin : {2.9, walk.end() / 2}) {
    const Integrated fine = integrate(walk, begin, 2000), coarse = integrate(walk, begin, 200);
    const auto figures = {fine.position, fine.attitude, coarse.position, coarse.attitude};
    RecordProperty(begin < 3 ? "from_rest" : "in_motion", fmt::format("{:.2e}", fmt::join(figures, " ")));
    EXPECT_LT(fine.position, 1e-3) << "from " << begin;
    EXPECT_LT(fine.attitude, 1e-3) << "from " << begin;
    EXPECT_LT(coarse.position, 10e-3) << "from " << begin;
    EXPECT_LT(coarse.attitude, 5e-3) << "from " << begin;
  }
}

// The foot by the kinematics of the exact joint angles from the exact torso.
SE3 foot_by_joints(const Walk& walk, Side side, double t) {
  const JointAngles q = walk.joints(t);
  LegAngles leg;
  std::copy_n(q.begin() + (side == Side::left ? 0 : leg_joint_count), leg_joint_count, leg.begin());
  const SE3 T_pelvis_torso{SO3::Exp({0, 0, q.back()}), walk.shape().waist};
  const SE3 T_WP = walk.imu(t) * walk.shape().T_torso_imu().inverse() * T_pelvis_torso.inverse();
  return T_WP * foot_in_pelvis(walk.shape(), side, leg);
}

TEST_P(EveryWalk, AStandingFootStaysOnItsFootprint) {
  const Walk walk = walk_of(GetParam());
  const std::set<std::string> sliding{"slip", "soft", "tiles", "robust"};
  const bool slides = sliding.contains(GetParam()), rolls = GetParam() == "rolling" || GetParam() == "stairs";
  double farthest = 0;  // m
  for (const Side side : {Side::left, Side::right}) {
    for (const Footprint& print : walk.plan().prints[side == Side::left ? 0 : 1]) {
      const double from = std::max(print.touch, 0.0), to = std::min(print.lift, walk.end());
      for (double t = from; t < to; t += 0.0137) {
        ASSERT_TRUE(walk.in_contact(side, t)) << t;
        const SE3 sole = foot_by_joints(walk, side, t) * SE3{SO3(), {0, 0, -walk.shape().sole_depth}};
        const Eigen::Vector3d heel(walk.shape().heel, 0, 0), toe(walk.shape().toe, 0, 0);
        const Eigen::Vector3d drift = print.displacement(t - print.touch);
        const double heel_off = (sole * heel - print.sole * heel - drift).norm(), toe_off = (sole * toe - print.sole * toe - drift).norm();
        // A sole that rolls keeps one of its edges where it is.
        const double off = rolls ? std::min(heel_off, toe_off) : std::max(heel_off, toe_off);
        farthest = std::max(farthest, off);
        ASSERT_LT(off, 1e-4) << "at " << t;
        ASSERT_TRUE(slides || drift.norm() == 0.0);
      }
    }
  }
  RecordProperty("farthest", fmt::format("{:.2e}", farthest));
}

TEST_P(EveryWalk, BeginsWithThreeSecondsOfRest) {
  const Walk walk = walk_of(GetParam());
  for (double t = 0; t < 3; t += 0.01) {
    ASSERT_LT((walk.imu(t).p - walk.imu(0).p).norm(), 1e-12) << t;
    ASSERT_LT(walk.angular_rate(t).norm(), 1e-9) << t;
  }
}

std::vector<std::string> names() {
  std::vector<std::string> out;
  // An hour of it would show what two rounds of the same rectangle do.
  for (const Scenario& s : scenarios()) {
    if (s.name != "hour") out.push_back(s.name);
  }
  return out;
}
INSTANTIATE_TEST_SUITE_P(Scenarios, EveryWalk, ::testing::ValuesIn(names()), [](const auto& each) { return each.param; });

// As other recordings of the same kinds are named.
TEST(Scenarios, TheKindsOfThePapersSequencesAreThere) {
  for (const char* name :
       {"room_short", "fwd_bwd", "walk_back", "square_walk", "walk_in_place", "spin", "run_room", "run", "slope", "corridor",
        "corridor_blank", "blank_wall", "soft_terrain", "slip", "outdoor", "robust", "tiles", "emergency_stop", "lifts"})
    EXPECT_NE(find_scenario(name), nullptr) << name;
  EXPECT_EQ(find_scenario("square_walk"), find_scenario("square"));
  EXPECT_EQ(find_scenario("moon"), nullptr);
}

TEST(Walk, AnEmergencyStopEndsARunWithinOneStep) {
  const Walk walk = walk_of("emergency_stop");
  const auto& steps = walk.plan().steps;
  const auto stop = std::ranges::adjacent_find(
      steps, [](const Step& a, const Step& b) { return a.gait.double_support < 0 && b.gait.double_support > 0; });
  ASSERT_NE(stop, steps.end());
  const auto speed = [&](double t) { return walk.velocity(t).head<2>().norm(); };
  const Step& last = *std::next(stop);
  EXPECT_GT(speed(stop->begin), 0.9);
  EXPECT_LT(speed(last.begin + 2 * last.period), 0.05);
}

TEST(Walk, ALiftedFootIsHeldUpWhileTheOtherStands) {
  const Walk walk = walk_of("lifts");
  const Step& step = walk.plan().steps[2];
  const double middle = step.begin + step.period / 2;
  EXPECT_FALSE(walk.in_contact(step.side, middle));
  EXPECT_GT((walk.foot(step.side, middle).p - walk.foot(step.side, step.begin).p).z(), 0.07);
  EXPECT_LT((walk.imu(middle).p - walk.imu(step.begin).p).head<2>().norm(), 0.08);
}

TEST(Walk, SlabsGiveWayUnderEachFoot) {
  const Walk walk = walk_of("tiles");
  for (const std::size_t side : {0U, 1U}) {
    const Footprint& print = walk.plan().prints[side][3];
    const Eigen::Vector3d moved = print.displacement(print.lift - print.touch);
    EXPECT_LT(moved.z(), -0.004);
    EXPECT_NEAR(moved.head<2>().norm(), 0.01, 1e-3);
  }
}

TEST(Walk, ImpactsRingInTheAccelerometerAndDieAway) {
  const Walk walk = walk_of("in_place");
  const Step& last = walk.plan().steps.back();
  const double touch = last.begin + last.period - last.gait.double_support / 2;
  const auto strongest = [&](double from, double to) {
    double out = 0;
    for (double t = from; t < to; t += 0.001) out = std::max(out, std::abs(walk.acceleration(t).z()));
    return out;
  };
  EXPECT_GT(strongest(touch, touch + 0.05), 1.5);
  EXPECT_LT(strongest(touch + 1.22, touch + 1.4), 1e-3);
}

TEST(Walk, RunningHasBothFeetInTheAirAndWalkingNever) {
  const auto flight = [](const Walk& walk) {
    int out = 0;
    for (double t = 0; t < walk.end(); t += 0.005) out += !walk.in_contact(Side::left, t) && !walk.in_contact(Side::right, t);
    return 0.005 * out;
  };
  EXPECT_GT(flight(walk_of("run")), 2.0);
  EXPECT_EQ(flight(walk_of("forward")), 0.0);
}

TEST(Walk, ASwingingFootClearsTheGround) {
  const Walk walk = walk_of("forward");
  const auto& prints = walk.plan().prints[0];
  const double middle = (prints[3].lift + prints[4].touch) / 2;
  for (const Eigen::Vector3d& corner : walk.shape().sole()) EXPECT_GT((walk.foot(Side::left, middle) * corner).z(), 0.05);
}

// What tells a sole's contact from a sole that hovers: it comes with a speed, and rests the next moment.
TEST(Walk, FeetLeaveAndLandWithSpeed) {
  const Walk walk = walk_of("forward");
  const Footprint& print = walk.plan().prints[0][3];
  const auto speed = [&](double t) { return (walk.foot(Side::left, t + 1e-4).p - walk.foot(Side::left, t - 1e-4).p).z() / 2e-4; };
  EXPECT_NEAR(speed(print.touch - 1e-3), -0.3, 0.02);
  EXPECT_EQ(speed(print.touch + 1e-3), 0);
  EXPECT_EQ(speed(print.lift - 1e-3), 0);
  EXPECT_LT(speed(print.lift + 1e-3), 0.02);
  EXPECT_NEAR(speed(print.lift + 0.01), 0.28, 0.02);
  EXPECT_GT((walk.foot(Side::left, print.lift + 0.007).p - walk.foot(Side::left, print.lift).p).z(), 5e-4);
}

TEST(Walk, ASlippingFootSlidesAndTheNextStepBeginsThere) {
  const Walk walk = walk_of("slip");
  const Footprint& print = walk.plan().prints[0][3];
  const double slid = (walk.foot(Side::left, print.lift).p - walk.foot(Side::left, print.touch).p).norm();
  EXPECT_NEAR(slid, 0.03, 1e-6);
  EXPECT_LT((walk.foot(Side::left, print.lift + 1e-6).p - walk.foot(Side::left, print.lift).p).norm(), 1e-6);
}

TEST(Walk, WhatTheLegsCannotDoIsAnErrorThatSaysWhenAndWhy) {
  const auto fault = [](const std::vector<Stage>& stages, const Ground& ground = {}) {
    try {
      const Walk walk(BipedShape{}, ground, Place{}, stages);
    } catch (const PlanError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(fault({{.stand = 3, .steps = 4, .gait = {.forward = 0.2}}}), "none");
  EXPECT_THAT(fault({{.stand = 3, .steps = 4, .gait = {.forward = 0.9}}}), HasSubstr("the leg reaches 0.600 m"));
  EXPECT_THAT(fault({{.stand = 3, .steps = 4, .gait = {.hip_height = 0.2}}}), HasSubstr("its limits are"));
  EXPECT_THAT(fault({{.stand = -1}}), HasSubstr("negative"));
  EXPECT_THAT(fault({{.steps = 2, .gait = {.period = 0.01}}}), HasSubstr("cannot be walked"));
  Ground sill;  // a sill between two footprints
  sill.add({0.4, 0.45, 0.05, 0.3, 0.1, 0.1});
  EXPECT_THAT(fault({{.stand = 3, .steps = 6, .gait = {.forward = 0.2, .lift = 0.05}}}, sill), HasSubstr("would hit the ground"));
}

TEST(JointEffort, LoadedLegsCarryTheRobotAndFreeOnesNothing) {
  const Walk walk = walk_of("forward");
  const auto shares = load_shares(walk, 1);
  EXPECT_EQ(shares[0], 0.5);
  EXPECT_EQ(shares[1], 0.5);
  // Standing on bent knees: each knee holds half the weight at the lever of its distance from the line of force.
  const JointAngles q = walk.joints(1), effort = joint_efforts(walk, 1, 35);
  const SE3 T = foot_in_pelvis(walk.shape(), Side::left, {q[0], q[1], q[2], q[3], q[4], q[5]});
  const SE3 thigh = foot_in_pelvis(walk.shape(), Side::left, {q[0], q[1], q[2], 0, 0, 0});
  const double knee_x = thigh.p.x() / (walk.shape().thigh + walk.shape().shin) * walk.shape().thigh;  // before the hip
  const double lever = knee_x - T.p.x() - (walk.shape().heel + walk.shape().toe) / 2;
  EXPECT_NEAR(std::abs(effort[3]), 35 * 9.80665 / 2 * std::abs(lever), 0.5);
  const auto& print = walk.plan().prints[0][2];
  const JointAngles swinging = joint_efforts(walk, print.lift + 0.1, 35);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(swinging[i], 0);
  EXPECT_GT(std::abs(swinging[9]), 5);
  EXPECT_NEAR(load_shares(walk, print.lift + 0.1)[1], 1, 1e-9);
}

TEST(Biped, InverseKinematicsIsTheInverseOfTheKinematics) {
  const BipedShape shape;
  Random random(3);
  int solved = 0;
  for (int i = 0; i < 500; ++i) {
    for (const Side side : {Side::left, Side::right}) {
      LegAngles q;
      for (std::size_t k = 0; k < q.size(); ++k) {
        const JointLimit limit = leg_limits()[k];
        q[k] = random.uniform(0.5 * std::max(limit.lower, -1.0), 0.5 * std::min(limit.upper, 2.0));
      }
      if (q[3] < 0.05) q[3] = 0.05;
      const LegSolution solution = solve_leg(shape, side, foot_in_pelvis(shape, side, q));
      for (std::size_t k = 0; k < q.size(); ++k) EXPECT_NEAR(solution.angles[k], q[k], 1e-9);
      solved += solution.fault.empty();
    }
  }
  EXPECT_GT(solved, 300);
}

TEST(Footing, AFootOnASlopeLiesOnItAndOneOverAnEdgeLiesLevel) {
  Ground ground;
  ground.add({0, 2, -1, 1, 0, 0.2});
  const BipedShape shape;
  const SE3 on_slope = ground.footing(shape, 1, 0, 0);
  EXPECT_NEAR(on_slope.p.z(), 0.1, 1e-12);
  EXPECT_NEAR((on_slope.R * Eigen::Vector3d::UnitX()).z(), 0.1 / std::hypot(1, 0.1), 1e-12);
  const SE3 over_edge = ground.footing(shape, 1.95, 0, 0);
  EXPECT_NEAR(over_edge.p.z(), 0.2, 0.01);
  EXPECT_EQ((over_edge.R * Eigen::Vector3d::UnitX()).z(), 0.0);
}

}  // namespace walk_test
}  // namespace kilvo::lab
