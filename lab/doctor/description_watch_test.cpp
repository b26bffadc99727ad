// Legs and IMU alone, which nothing else contradicts: what fitted the description at first and no longer does is reported.
#include "lab/doctor/description_watch.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace description_watch_test {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double failure = 20;  // s after the start

/// Legs and IMU of 76 s of a walk round a rectangle.
struct Walked {
  std::vector<Measurement> measurements;
  Time start{};
  Robot robot;
};

const Walked& walked() {
  static const Walked walk = [] {
    SimulatorConfig config;
    config.duration = 76;
    config.use = {true, true, false, false};
    const std::vector<Scenario> all = scenarios();
    Simulator simulator(*std::ranges::find(all, "hour", &Scenario::name), config);
    Walked out;
    out.start = simulator.start();
    while (auto measurement = simulator.next()) out.measurements.push_back(*std::move(measurement));
    const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
    out.robot = parse_settings(simulated_config(config, urdf), "simulated", ".").robot;
    out.robot.urdf = urdf_of(config.shape);
    return out;
  }();
  return walk;
}

/// `change`: of each measurement, with the seconds since the start. Messages without names are lost.
std::vector<WrongDescription> watched(DescriptionWatch::Judging judging, const std::function<void(Measurement&, double)>& change,
                                      double until = INFINITY) {
  DescriptionWatch watch(walked().robot, {}, judging);
  for (Measurement measurement : walked().measurements) {
    const double t = to_seconds(stamp_of(measurement) - walked().start);
    if (t > until) break;
    change(measurement, t);
    if (const auto* legs = std::get_if<JointSample>(&measurement); legs != nullptr && legs->names.empty()) continue;
    watch.take(measurement);
  }
  return watch.finish();
}

void freeze_gyro(Measurement& m, double t) {
  if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && t > failure) imu->gyro.z() = 0.1;
}

void freeze_gyro_early(Measurement& m, double t) {
  if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && t > 14.1) imu->gyro.z() = 0.1;
}

// The IMU of the simulation hangs as that of a G1: z down.
void shift_gyro(Measurement& m, double t) {
  if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && t > failure) imu->gyro.z() += 0.05;
}

void turn_knee_round(Measurement& m, double t) {
  auto* legs = std::get_if<JointSample>(&m);
  if (legs == nullptr || legs->names.empty() || t < failure) return;
  const auto knee = std::ranges::find(legs->names, "left_knee_joint");
  ASSERT_NE(knee, legs->names.end());
  const auto i = static_cast<std::size_t>(knee - legs->names.begin());
  legs->position[i] *= -1;
  if (i < legs->velocity.size()) legs->velocity[i] *= -1;
}

void slip_knee(Measurement& m, double t, double from) {
  auto* legs = std::get_if<JointSample>(&m);
  if (legs == nullptr || legs->names.empty() || t < from) return;
  const auto knee = std::ranges::find(legs->names, "left_knee_joint");
  ASSERT_NE(knee, legs->names.end());
  legs->position[static_cast<std::size_t>(knee - legs->names.begin())] += 0.3;
}

TEST(DescriptionWatch, NamesAJointThatJumpsAndStaysThere) {
  for (const double from : {failure, 5.0}) {
    const std::vector<WrongDescription> wrong =
        watched(DescriptionWatch::Judging::here, [from](Measurement& m, double t) { slip_knee(m, t, from); });
    const auto slip = std::ranges::find(wrong, "joint_slip", [](const WrongDescription& w) { return w.finding.cause; });
    ASSERT_NE(slip, wrong.end()) << from;
    EXPECT_THAT(slip->finding.text, HasSubstr("left_knee_joint has jumped by 0.30 rad"));
    EXPECT_TRUE(slip->spoils && slip->has_changed);
  }
}

TEST(DescriptionWatch, HasNothingAgainstLegsAndImuThatStayRight) {
  EXPECT_THAT(watched(DescriptionWatch::Judging::here, [](Measurement&, double) {}), IsEmpty());
}

TEST(DescriptionWatch, ReportsWhatChangesOnTheWay) {
  const std::vector<std::pair<std::string, std::function<void(Measurement&, double)>>> faults{
      {"gyro_frozen", freeze_gyro}, {"gyro_bias", shift_gyro}, {"joint_sign", turn_knee_round}};
  for (const auto& [cause, fault] : faults) {
    const std::vector<WrongDescription> here = watched(DescriptionWatch::Judging::here, fault);
    ASSERT_FALSE(here.empty()) << cause;
    for (const WrongDescription& wrong : here) {
      EXPECT_EQ(wrong.finding.cause, cause);
      EXPECT_TRUE(wrong.has_changed);
      EXPECT_FALSE(wrong.is_mendable) << "the beginning fits as described";
      EXPECT_THAT(wrong.finding.changes, IsEmpty());
      EXPECT_THAT(wrong.finding.text, HasSubstr("s of data, and not before: "));
      EXPECT_GT(wrong.after, failure);
    }
    EXPECT_TRUE(here.back().spoils) << cause;
    // However fast it is judged.
    const std::vector<WrongDescription> beside = watched(DescriptionWatch::Judging::beside, fault);
    ASSERT_EQ(beside.size(), here.size()) << cause;
    for (std::size_t i = 0; i < here.size(); ++i) {
      EXPECT_EQ(beside[i].finding.text, here[i].finding.text);
      EXPECT_EQ(beside[i].t, here[i].t);
    }
  }
}

TEST(DescriptionWatch, MeasuresByHowMuchTheBiasOfTheGyroHasChanged) {
  const std::vector<WrongDescription> wrong = watched(DescriptionWatch::Judging::here, shift_gyro);
  ASSERT_FALSE(wrong.empty());
  EXPECT_NEAR(std::abs(wrong[0].finding.size), 0.05, 0.01);
  EXPECT_THAT(watched(DescriptionWatch::Judging::here,
                      [](Measurement& m, double t) {
                        if (auto* imu = std::get_if<ImuSample>(&m)) imu->gyro.z() += 1e-4 * t;  // warms up by 0.0076 rad/s
                      }),
              IsEmpty());
}

// One window may err: a recording that ends with it has a warning.
TEST(DescriptionWatch, WarnsOfWhatTheLastWindowAloneShows) {
  const std::vector<WrongDescription> wrong = watched(DescriptionWatch::Judging::here, turn_knee_round, 46);
  ASSERT_EQ(wrong.size(), 1U);
  EXPECT_EQ(wrong[0].finding.cause, "joint_sign");
  EXPECT_TRUE(wrong[0].has_changed);
  EXPECT_FALSE(wrong[0].spoils);
}

// Without enough data after the first window nothing more is judged.
TEST(DescriptionWatch, DoesNotJudgeAShortRemainder) {
  for (const double until : {15.0, 18.0, 22.5})
    EXPECT_THAT(watched(DescriptionWatch::Judging::here, freeze_gyro_early, until), IsEmpty()) << until;
}

// What nothing but the IMU showed is not known.
TEST(DescriptionWatch, JudgesLegsThatBeginLate) {
  const auto late = [](Measurement& m, double t) {
    turn_knee_round(m, failure + 1);
    auto* legs = std::get_if<JointSample>(&m);
    if (legs != nullptr && t < 12) legs->names = {};
  };
  const std::vector<WrongDescription> wrong = watched(DescriptionWatch::Judging::here, late);
  ASSERT_FALSE(wrong.empty());
  EXPECT_FALSE(wrong[0].has_changed);
  EXPECT_EQ(wrong[0].finding.cause, "joint_sign");
}

// Soles that turn on soft ground hide how the legs turn.
void turn_soles(Measurement& m, double t) {
  auto* legs = std::get_if<JointSample>(&m);
  if (legs == nullptr) return;
  for (std::size_t i = 0; i < legs->names.size(); ++i) {
    if (legs->names[i].find("ankle") != std::string::npos) legs->position[i] += 0.06 * std::sin(12 * t + static_cast<double>(i));
  }
}

// Nor are right legs accused, though no window shows how they turn.
TEST(DescriptionWatch, FindsAMountOnSolesThatTurn) {
  const Eigen::Matrix3d R = SO3::Exp(10 * M_PI / 180 * Eigen::Vector3d(0.3, 0.3, 0.9).normalized()).matrix();
  const auto turned = [&R](Measurement& m, double t) {
    turn_soles(m, t);
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu != nullptr) imu->gyro = R * imu->gyro, imu->accel = R * imu->accel;
  };
  const std::vector<WrongDescription> wrong = watched(DescriptionWatch::Judging::here, turned);
  ASSERT_EQ(wrong.size(), 1U);
  EXPECT_EQ(wrong[0].finding.cause, "imu_mount_rotation");
  EXPECT_NEAR(wrong[0].finding.size, 10, 4);
  EXPECT_FALSE(wrong[0].has_changed);
  const std::vector<WrongDescription> beside = watched(DescriptionWatch::Judging::beside, turned);
  ASSERT_EQ(beside.size(), 1U);
  EXPECT_EQ(beside[0].finding.text, wrong[0].finding.text);
  EXPECT_THAT(watched(DescriptionWatch::Judging::here, turn_soles), IsEmpty());
}

// The zeros of a joint_state_publisher between the robot's own messages.
TEST(DescriptionWatch, FindsASecondPublisherOfTheJoints) {
  const auto with_zeros = [](std::size_t every) {
    DescriptionWatch watch(walked().robot, {}, DescriptionWatch::Judging::here);
    std::size_t messages = 0;
    for (const Measurement& measurement : walked().measurements) {
      if (to_seconds(stamp_of(measurement) - walked().start) > 10) break;
      watch.take(measurement);
      const auto* legs = std::get_if<JointSample>(&measurement);
      if (legs == nullptr || ++messages % every != 0) continue;
      JointSample zeros = *legs;
      zeros.t += std::chrono::microseconds(200);
      std::ranges::fill(zeros.position, 0);
      std::vector<std::string> names = zeros.names.list();  // in the order of the URDF, say
      std::ranges::reverse(names);
      zeros.names = names;
      watch.take(zeros);
    }
    return watch.finish();
  };
  const std::vector<WrongDescription> often = with_zeros(20), seldom = with_zeros(500);
  ASSERT_EQ(often.size(), 1U);
  EXPECT_EQ(often[0].finding.cause, "joints_jump");
  EXPECT_NEAR(often[0].finding.size, 1 / 21.0, 0.01);
  EXPECT_TRUE(often[0].spoils);
  ASSERT_EQ(seldom.size(), 1U);
  EXPECT_EQ(seldom[0].finding.cause, "joints_jump");
  EXPECT_FALSE(seldom[0].spoils || seldom[0].is_mendable);
}

// A finger is no part of the description.
TEST(DescriptionWatch, HasNothingAgainstOtherJointsThatJump) {
  bool there = false;
  const auto rattle = [&there](Measurement& m, double) {
    auto* legs = std::get_if<JointSample>(&m);
    if (legs == nullptr) return;
    std::vector<std::string> names = legs->names.list();
    names.emplace_back("left_finger_joint");
    legs->names = names;
    legs->position.push_back((there = !there) ? 0.5 : 0);
    if (!legs->velocity.empty()) legs->velocity.push_back(0);
    if (!legs->effort.empty()) legs->effort.push_back(0);
  };
  EXPECT_THAT(watched(DescriptionWatch::Judging::here, rattle, 20), IsEmpty());
}

// Stamps that jump back by more than a second are those of another recording.
TEST(DescriptionWatch, BeginsAnewWhereStampsJumpBack) {
  DescriptionWatch watch(walked().robot, {}, DescriptionWatch::Judging::here);
  for (const double earlier : {0.0, 1000.0}) {
    for (Measurement measurement : walked().measurements) {
      if (to_seconds(stamp_of(measurement) - walked().start) > 40) break;
      std::visit([&](auto& m) { m.t -= from_seconds(earlier); }, measurement);
      if (earlier > 0) turn_knee_round(measurement, failure + 1);
      watch.take(measurement);
    }
    if (earlier == 0) {
      EXPECT_THAT(watch.news(), IsEmpty());
    }
  }
  const std::vector<WrongDescription> wrong = watch.finish();
  ASSERT_FALSE(wrong.empty());
  EXPECT_EQ(wrong[0].finding.cause, "joint_sign");
}

// From the first window on it is the description that is wrong.
TEST(DescriptionWatch, TakesWhatIsWrongFromTheStartForTheDescription) {
  const std::vector<WrongDescription> wrong =
      watched(DescriptionWatch::Judging::here, [](Measurement& m, double) { turn_knee_round(m, failure + 1); });
  ASSERT_FALSE(wrong.empty());
  EXPECT_EQ(wrong[0].finding.cause, "joint_sign");
  EXPECT_FALSE(wrong[0].has_changed);
  EXPECT_TRUE(wrong[0].spoils && wrong[0].is_mendable);
}

TEST(DescriptionWatch, WhatMoreDataRefuteIsAWarningAndChangesNothing) {
  Finding finding;
  finding.cause = "lidar_rotation";
  finding.size = 5;
  finding.changes = {{"lidar.T_imu_lidar.R", "[1, 0, 0, 0, 1, 0, 0, 0, 1]"}};
  WrongDescription wrong = as_wrong(finding, {}, 9);
  ASSERT_TRUE(wrong.spoils && wrong.is_mendable);
  refute(wrong);
  EXPECT_FALSE(wrong.spoils || wrong.is_mendable || !wrong.finding.changes.empty());
  EXPECT_THAT(wrong.finding.remedy, testing::HasSubstr("the description is used as it is"));
}

// Feet of a runner who slips may never show whether their mount is right.
TEST(DescriptionWatch, ALiDARIsClearedByMoreDataThoughTheLegsStayUnknown) {
  Finding finding{Sensor::lidar, "lidar_position", "", "", "", 0.05, "m", {}, true};
  Diagnosis longer;
  longer.checks = {{Sensor::lidar, "position of the mount", Check::Verdict::good, ""},
                   {Sensor::legs, "clock", Check::Verdict::unknown, ""}};
  EXPECT_TRUE(is_refuted(finding, longer));
  finding.sensor = Sensor::imu;
  EXPECT_FALSE(is_refuted(finding, longer));
  finding.sensor = Sensor::lidar;
  longer.seems_wrong[index_of(Sensor::lidar)] = true;
  EXPECT_FALSE(is_refuted(finding, longer));
  longer.seems_wrong = {};
  longer.findings = {finding};
  EXPECT_FALSE(is_refuted(finding, longer));
}

}  // namespace description_watch_test
}  // namespace kilvo::lab
