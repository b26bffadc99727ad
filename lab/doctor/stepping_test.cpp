// Legs are judged where they step.
#include "lab/doctor/stepping.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/doctor/examination.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace stepping_test {

/// Feet whose places differ by `apart(t)`, m.
std::vector<LegPose> legs(double seconds, const std::function<Eigen::Vector3d(double)>& apart) {
  std::vector<LegPose> out;
  for (double t = 0; t < seconds; t += 0.01) {
    LegPose pose;
    pose.t = t;
    pose.foot[0].p[0].setZero();
    pose.foot[1].p[0] = Eigen::Vector3d(0, 0.2, 0) + apart(t);
    out.push_back(pose);
  }
  return out;
}

Eigen::Vector3d stride(double t) { return t < 3 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.2 * std::sin(2 * M_PI * (t - 3)), 0, 0); }

TEST(Stepping, CountsHowOftenTheFeetPassEachOther) {
  const Stepping walk = stepping_of(legs(8, stride));
  EXPECT_NEAR(walk.steps, 10, 1) << "two a second, for 5 s";
  EXPECT_TRUE(walk.walks());
  EXPECT_NEAR(walk.begin, 3, 0.6);
  EXPECT_NEAR(walk.end, 8, 0.5);
  EXPECT_TRUE(walk.bears(2.5)) << "a robot stands before it walks";
  EXPECT_FALSE(walk.bears(0.5)) << "and may have lain or hung before that";
}

TEST(Stepping, IsNoneOfARobotThatStandsOrGetsUp) {
  EXPECT_FALSE(stepping_of({}).walks());
  EXPECT_FALSE(stepping_of(legs(8, [](double t) { return Eigen::Vector3d(0.002 * std::sin(9 * t), 0, 0); })).walks());
  EXPECT_FALSE(stepping_of(legs(8, [](double t) { return Eigen::Vector3d(0.4 * std::tanh(t - 4), 0.1 * std::sin(t), 0); })).walks());
}

TEST(Stepping, OnTheSpotCounts) {
  EXPECT_TRUE(stepping_of(legs(8, [](double t) { return Eigen::Vector3d(0, 0, stride(t).x() / 5); })).walks());
}

TEST(Stepping, IsNoneOfAPostureThatChangesInStages) {
  const auto stages = [](double t) { return Eigen::Vector3d(0.1 * (std::tanh(t - 8) + std::tanh(t - 20) + std::tanh(t - 32)), 0, 0); };
  EXPECT_FALSE(stepping_of(legs(40, stages)).walks());
}

// It sets one foot before the other all the time, the other way round when it turns back.
TEST(Stepping, OfARobotThatTurnsOnTheSpotCounts) {
  const auto turning = [](double t) { return Eigen::Vector3d((t < 18 ? 0.06 : -0.07) + 0.14 * stride(t).x(), 0, 0); };
  const Stepping steps = stepping_of(legs(33, turning));
  EXPECT_GT(steps.steps, 40) << "of 60: a few about the time when it turns back are missed";
  EXPECT_NEAR(steps.seconds(), 30, 2);
}

/// Legs and IMU of a simulated walk of 12 s, of which it stands for 3 s first.
class LyingRobot : public testing::Test {
 protected:
  void SetUp() override {
    SimulatorConfig config;
    config.duration = 12;
    config.use = {true, true, false, false};
    const std::vector<Scenario> all = scenarios();
    Simulator simulator(*std::ranges::find(all, "room", &Scenario::name), config);
    Recorder recorder;
    while (const auto measurement = simulator.next()) recorder.push(*measurement);
    recorded_ = recorder.finish();
    const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
    robot_ = parse_settings(simulated_config(config, urdf), "simulated", ".").robot;
    robot_.urdf = urdf_of(config.shape);
  }
  std::vector<std::string> causes() const {
    std::vector<std::string> out;
    for (const Finding& finding : Examination(recorded_, robot_).run().findings) out.push_back(finding.cause);
    return out;
  }
  void lie(double until) {
    const Eigen::Matrix3d on_its_back = SO3::Exp({0, 1.5, 0}).matrix();
    for (InertialSample& s : recorded_.imu) {
      if (s.t < until) s.accel = on_its_back * s.accel;
    }
  }

  Recorded recorded_;
  Robot robot_;
};

TEST_F(LyingRobot, IsNotDescribedWrongly) {
  std::erase_if(recorded_.imu, [](const InertialSample& s) { return s.t > 3; });
  std::erase_if(recorded_.legs, [](const LegSample& s) { return s.t > 3; });
  lie(3);
  EXPECT_THAT(causes(), testing::IsEmpty());
}

TEST_F(LyingRobot, ThatWalksMustBeUpright) {
  lie(12);
  EXPECT_THAT(causes(), testing::Contains(testing::AnyOf("imu_axes", "imu_mount_rotation")));
}

}  // namespace stepping_test
}  // namespace kilvo::lab
