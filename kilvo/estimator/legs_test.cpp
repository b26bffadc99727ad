// The estimator with legs, on a room whose truth is a formula: feet that stay where they are under a body that moves.
#include <algorithm>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <string>
#include <vector>

#include "kilvo/estimator/estimator.hpp"
#include "lab/simulation/analytic_room.hpp"

namespace kilvo {
namespace legs_test {

using std::chrono::milliseconds;

constexpr std::array<bool, sensor_count> imu_and_legs = {true, true, false, false}, all_three = {true, true, true, false};
constexpr double leg_rate = 500;  // Hz

// A body that sways over its feet: 8 cm to the sides, 2 cm up and down, turning; from `still` on.
lab::AnalyticRoomConfig swaying() {
  lab::AnalyticRoomConfig config;
  config.path = lab::AnalyticRoomConfig::Path::straight;
  config.duration = 7;
  config.points_per_scan = 3000;
  return config;
}

struct Drive {
  std::vector<Output> outputs;
  Statistics statistics;
  double worst_position = 0, worst_rotation = 0;  // m, rad
  double last_position = 0;                       // m
};

// The two-feet message of feet that rest in the room.
JointSample feet_at_rest(const lab::AnalyticRoom& room, Time t) {
  const SE3 T = room.truth(t);
  constexpr Duration h = milliseconds(1);
  JointSample s;
  s.t = t;
  const auto of = [](const SE3& pose, double y) { return Eigen::Vector3d(pose.inverse() * Eigen::Vector3d(0, y, -1.2)); };
  for (const double y : {0.1, -0.1}) {
    const Eigen::Vector3d p = of(T, y), v = (of(room.truth(t + h), y) - of(room.truth(t - h), y)) / (2 * to_seconds(h));
    s.position.insert(s.position.end(), {p.x(), p.y(), p.z()});
    s.velocity.insert(s.velocity.end(), {v.x(), v.y(), v.z()});
  }
  return s;
}

// `edit` may change a measurement or, by returning false, keep it away; it is given the time since the start, s.
Drive drive(const lab::AnalyticRoomConfig& room_config, std::array<bool, sensor_count> used,
            const std::function<bool(Measurement&, double)>& edit = {}) {
  lab::AnalyticRoom room(room_config);
  Robot robot;
  robot.lidar.T_imu_lidar = room_config.T_imu_lidar;
  robot.legs.type = "feet";
  robot.legs.rate = leg_rate;
  Estimator estimator(robot, EstimatorConfig{}, used);
  Drive out;
  const auto push = [&](Measurement m) {
    if (edit && !edit(m, to_seconds(stamp_of(m) - room.start()))) return;
    for (Output& o : estimator.push(std::move(m))) out.outputs.push_back(std::move(o));
  };
  Time next_legs = room.start();
  while (auto m = room.next()) {
    for (; next_legs <= stamp_of(*m); next_legs += from_seconds(1 / leg_rate)) push(feet_at_rest(room, next_legs));
    push(std::move(*m));
  }
  for (Output& o : estimator.finish()) out.outputs.push_back(std::move(o));
  out.statistics = estimator.statistics();
  if (out.outputs.empty()) return out;
  const SE3 T_WR = out.outputs.front().x.pose() * room.truth(out.outputs.front().t).inverse();
  for (const Output& o : out.outputs) {
    const SE3 truth = T_WR * room.truth(o.t);
    out.last_position = (truth.p - o.x.p).norm();
    out.worst_position = std::max(out.worst_position, out.last_position);
    out.worst_rotation = std::max(out.worst_rotation, (truth.R.inverse() * o.x.R).Log().norm());
  }
  return out;
}

void expect_sane(const Drive& r) {
  Time last{};
  for (const Output& o : r.outputs) {
    ASSERT_GE(o.t, last);
    last = o.t;
    ASSERT_TRUE(is_finite({o.t, o.x, o.P}));
    ASSERT_LE((o.P - o.P.transpose()).norm(), 1e-14 * o.P.norm());
  }
  EXPECT_EQ(r.statistics.rollbacks, 0u);
  EXPECT_FALSE(r.statistics.diverged);
}

std::uint64_t dropped(const Drive& r, Sensor s, const std::string& cause) {
  const auto& causes = r.statistics.sensors[static_cast<std::size_t>(s)].dropped;
  const auto it = causes.find(cause);
  return it == causes.end() ? 0 : it->second;
}

std::uint64_t used(const Drive& r, Sensor s) { return r.statistics.sensors[static_cast<std::size_t>(s)].used; }

// The modalities in their order, each with its cause.
std::vector<std::string> modalities(const Drive& r) {
  std::vector<std::string> out;
  for (const Output& o : r.outputs) {
    const std::string now = std::string(name_of(o.modality)) + ", " + text_of(o.cause);
    if (out.empty() || out.back() != now) out.push_back(now);
  }
  return out;
}

TEST(Legs, WithImuAloneTheyHoldASwayingRobotWithinAFewMillimetresAtTheirRate) {
  const Drive r = drive(swaying(), imu_and_legs);
  expect_sane(r);
  EXPECT_LT(r.worst_position, 0.015);
  EXPECT_LT(r.worst_rotation, 0.01);
  EXPECT_EQ(modalities(r), std::vector<std::string>{"KI, start"});
  EXPECT_NEAR(static_cast<double>(r.outputs.size()), 7 * leg_rate, 3);
  for (std::size_t i = 1; i < r.outputs.size(); ++i) ASSERT_EQ(r.outputs[i].t - r.outputs[i - 1].t, milliseconds(2));
  for (const Output& o : r.outputs) ASSERT_TRUE(o.contacts && o.contacts->on[0] && o.contacts->on[1]);
  EXPECT_NEAR(static_cast<double>(used(r, Sensor::legs)), 7 * leg_rate + 1, 2);
  EXPECT_EQ(used(r, Sensor::imu), 1401u);
  EXPECT_EQ(used(r, Sensor::lidar), 0u);
}

TEST(Legs, WithLidarTheyAreKilAndNoWorseThanTheLidar) {
  auto config = swaying();
  config.duration = 5;
  const Drive r = drive(config, all_three);
  expect_sane(r);
  EXPECT_LT(r.worst_position, 0.01);
  EXPECT_LT(r.worst_rotation, 0.004);
  EXPECT_EQ(modalities(r), std::vector<std::string>{"KIL, start"});
  EXPECT_NEAR(static_cast<double>(r.outputs.size()), 5 * leg_rate, 5);
  EXPECT_GE(std::ranges::count_if(r.outputs, [](const Output& o) { return o.is_sweep; }), 48);
}

TEST(Legs, ThatFallSilentAreLostAndComeBackWithoutAStep) {
  const auto without = [](Measurement& m, double s) { return sensor_of(m) != Sensor::legs || s < 3.0 || s >= 3.2; };
  auto config = swaying();
  config.duration = 5;
  const Drive ki = drive(config, imu_and_legs, without);
  expect_sane(ki);
  EXPECT_EQ(modalities(ki), (std::vector<std::string>{"KI, start", "COAST, legs lost", "KI, legs are back"}));
  EXPECT_LT(ki.worst_position, 0.02);
  EXPECT_EQ(std::ranges::count_if(ki.outputs, [](const Output& o) { return !o.contacts; }), 40) << "at the IMU's rate from 3.0 to 3.2 s";
  const Drive kil = drive(config, all_three, without);
  expect_sane(kil);
  EXPECT_EQ(modalities(kil), (std::vector<std::string>{"KIL, start", "LI, legs lost", "KIL, legs are back"}));
  EXPECT_LT(kil.worst_position, 0.01);
}

TEST(Legs, CarryOnWhenTheLidarFallsSilent) {
  auto config = swaying();
  config.duration = 6;
  const Drive r = drive(config, all_three, [](Measurement& m, double s) { return sensor_of(m) != Sensor::lidar || s < 3.0; });
  expect_sane(r);
  EXPECT_EQ(modalities(r), (std::vector<std::string>{"KIL, start", "KI, lidar lost"}));
  EXPECT_LT(r.worst_position, 0.02);
}

TEST(Legs, WhatIsNotFiniteIsDroppedAndCounted) {
  auto config = swaying();
  config.duration = 4;
  int number = 0;
  const Drive r = drive(config, imu_and_legs, [&number](Measurement& m, double) {
    auto* legs = std::get_if<JointSample>(&m);
    if (legs == nullptr) return true;
    if (++number == 1500) legs->position[4] = std::numeric_limits<double>::quiet_NaN();
    if (number == 1600) legs->velocity[0] = std::numeric_limits<double>::infinity();
    if (number == 1700) legs->position.clear();
    if (number == 1800) legs->position.resize(5);
    return true;
  });
  expect_sane(r);
  EXPECT_EQ(dropped(r, Sensor::legs, "not finite"), 2u);
  EXPECT_EQ(dropped(r, Sensor::legs, "empty"), 1u);
  EXPECT_EQ(dropped(r, Sensor::legs, "two feet need six positions"), 1u);
  EXPECT_EQ(used(r, Sensor::legs) + 4, static_cast<std::uint64_t>(number));
  EXPECT_LT(r.worst_position, 0.01);
}

// The left foot's encoders say from then on what they said last, with or without their last velocity.
TEST(Legs, FrozenEncodersOfOneFootBreakNothingWhileTheLidarSees) {
  auto config = swaying();
  config.duration = 6;
  for (const bool velocity_too : {false, true}) {
    SCOPED_TRACE(velocity_too);
    JointSample last;
    const Drive r = drive(config, all_three, [&](Measurement& m, double s) {
      auto* legs = std::get_if<JointSample>(&m);
      if (legs == nullptr) return true;
      if (s < 3.5) last = *legs;
      for (std::size_t i = 0; s >= 3.5 && i < 3; ++i) {
        legs->position[i] = last.position[i];
        legs->velocity[i] = velocity_too ? last.velocity[i] : 0;
      }
      return true;
    });
    expect_sane(r);
    EXPECT_LT(r.worst_position, 0.05);
    EXPECT_LT(r.last_position, 0.03);
  }
}

TEST(Legs, FrozenEncodersOfOneFootAreOutlivedWithoutLidar) {
  auto config = swaying();
  config.duration = 5;
  JointSample last;
  const Drive r = drive(config, imu_and_legs, [&](Measurement& m, double s) {
    auto* legs = std::get_if<JointSample>(&m);
    if (legs == nullptr) return true;
    if (s < 3.5) last = *legs;
    for (std::size_t i = 0; s >= 3.5 && i < 3; ++i) {
      legs->position[i] = last.position[i];
      legs->velocity[i] = 0;
    }
    return true;
  });
  expect_sane(r);
  EXPECT_LT(r.worst_position, 0.3) << "1.5 s; the body moves at 0.6 m/s";
}

TEST(Legs, OfAnotherMountDoNotSpoilWhatTheLidarSees) {
  const SO3 wrong = SO3::Exp({0, 0, 0.8});
  auto config = swaying();
  config.duration = 6;
  const Drive r = drive(config, all_three, [&](Measurement& m, double) {
    auto* legs = std::get_if<JointSample>(&m);
    for (std::size_t k = 0; legs != nullptr && k < 6; k += 3) {
      const Eigen::Vector3d p = wrong * Eigen::Vector3d(legs->position[k], legs->position[k + 1], legs->position[k + 2]);
      const Eigen::Vector3d v = wrong * Eigen::Vector3d(legs->velocity[k], legs->velocity[k + 1], legs->velocity[k + 2]);
      for (std::size_t i = 0; i < 3; ++i) {
        legs->position[k + i] = p[static_cast<Eigen::Index>(i)];
        legs->velocity[k + i] = v[static_cast<Eigen::Index>(i)];
      }
    }
    return true;
  });
  expect_sane(r);
  EXPECT_LT(r.worst_position, 0.05);
}

TEST(Legs, ThatNeverSpeakAreLostAfter50Milliseconds) {
  auto config = swaying();
  config.duration = 3;
  const Drive r = drive(config, all_three, [](Measurement& m, double) { return sensor_of(m) != Sensor::legs; });
  expect_sane(r);
  EXPECT_EQ(modalities(r), (std::vector<std::string>{"KIL, start", "LI, legs lost"}));
  EXPECT_LT(r.worst_position, 0.005);
  EXPECT_GT(r.outputs.size(), 580u);
}

TEST(Legs, ThatAreNotUsedAreCounted) {
  auto config = swaying();
  config.duration = 2;
  const Drive r = drive(config, {true, false, false, false});
  EXPECT_GT(dropped(r, Sensor::legs, "not used"), 900u);
}

}  // namespace legs_test
}  // namespace kilvo
