// The velocities of the joints against the change of their positions.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/doctor/examination.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace joint_speeds_test {

/// 9 s in a room by legs and IMU, of which the robot walks 6.
class JointSpeeds : public testing::Test {
 protected:
  static const Recorded& recorded() {
    static const Recorded out = [] {
      const std::vector<Scenario> all = scenarios();
      Simulator simulator(*std::ranges::find(all, "room", &Scenario::name), config());
      Recorder recorder;
      while (const auto measurement = simulator.next()) recorder.push(*measurement);
      return recorder.finish();
    }();
    return out;
  }
  static SimulatorConfig config() {
    SimulatorConfig out;
    out.duration = 9;
    out.use = {true, true, false, false};
    return out;
  }
  static Recorded changed(const std::function<void(LegSample&)>& change) {
    Recorded out = recorded();
    for (LegSample& s : out.legs) change(s);
    return out;
  }
  static Robot walked_robot() {
    const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
    Robot robot = parse_settings(simulated_config(config(), urdf), "simulated", ".").robot;
    robot.urdf = urdf_of(config().shape);
    return robot;
  }
  static Diagnosis judged(const std::function<void(LegSample&)>& change) {
    const Recorded messages = changed(change);
    return Examination(messages, walked_robot()).run();
  }
  static std::vector<std::string> causes(const std::function<void(LegSample&)>& change) {
    std::vector<std::string> out;
    for (const Finding& finding : judged(change).findings) out.push_back(finding.cause);
    return out;
  }
  static auto times(double factor) {
    return [factor](LegSample& s) {
      for (double& v : s.velocity) v *= factor;
    };
  }
};

TEST_F(JointSpeeds, ThatAreThoseOfThePositionsAreGood) {
  const Diagnosis diagnosis = judged([](LegSample&) {});
  EXPECT_TRUE(diagnosis.good());
  const auto check = std::ranges::find(diagnosis.checks, "velocities of the joints", &Check::what);
  ASSERT_NE(check, diagnosis.checks.end());
  EXPECT_EQ(check->verdict, Check::Verdict::good);
}

TEST_F(JointSpeeds, ThatAreZeroAreNamed) {
  const Diagnosis diagnosis = judged(times(0));
  ASSERT_EQ(diagnosis.findings.size(), 1u);
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_velocity");
  EXPECT_EQ(diagnosis.findings[0].sensor, Sensor::legs);
  EXPECT_THAT(diagnosis.findings[0].text, testing::HasSubstr("zeros"));
}

TEST_F(JointSpeeds, OfAnotherUnitAreNamedWithTheirFactor) {
  for (const double factor : {57.29577951308232, 9.5493, 0.01745329251994}) {
    const Diagnosis diagnosis = judged(times(factor));
    ASSERT_EQ(diagnosis.findings.size(), 1u) << factor;
    EXPECT_EQ(diagnosis.findings[0].cause, "joint_velocity");
    EXPECT_NEAR(diagnosis.findings[0].size / factor, 1, 0.05);
  }
}

// A driver's filter takes a part of the velocity, and none is needed at all.
TEST_F(JointSpeeds, ThatAFilterMakesSmallerOrThatAreAbsentAreNot) {
  EXPECT_THAT(causes(times(0.7)), testing::IsEmpty());
  EXPECT_THAT(causes([](LegSample& s) { s.velocity.clear(); }), testing::IsEmpty());
}

// What does not follow the positions at all has no unit.
TEST_F(JointSpeeds, OfNoiseAreNamedAsNoVelocities) {
  int k = 0;
  const Diagnosis diagnosis = judged([&k](LegSample& s) {
    for (double& v : s.velocity) v = 5 * std::sin(++k * 12.9898);
  });
  ASSERT_EQ(diagnosis.findings.size(), 1u);
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_velocity");
  EXPECT_THAT(diagnosis.findings[0].text, testing::HasSubstr("do not follow"));
}

TEST_F(JointSpeeds, InAnotherOrderThanThePositionsAreNamedWithTheSettingThatDoesWithoutThem) {
  const Diagnosis diagnosis = judged([](LegSample& s) { std::ranges::rotate(s.velocity, s.velocity.begin() + 1); });
  ASSERT_EQ(diagnosis.findings.size(), 1u);
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_velocity");
  ASSERT_EQ(diagnosis.findings[0].changes.size(), 1u);
  EXPECT_EQ(diagnosis.findings[0].changes[0].key, "legs.velocities");
  EXPECT_EQ(diagnosis.findings[0].changes[0].value, "positions");
}

TEST_F(JointSpeeds, ThatAreNotUsedAreNotJudged) {
  Robot robot = walked_robot();
  robot.legs.velocities = "positions";
  const Recorded messages = changed(times(20));
  EXPECT_TRUE(Examination(messages, robot).run().good());
}

// All else is judged as before.
TEST_F(JointSpeeds, ThatAreNotUsedHideNoOtherFault) {
  Robot robot = walked_robot();
  robot.legs.velocities = "positions";
  const Recorded messages = changed([](LegSample& s) { s.position[3] = 0.3; });
  const Diagnosis diagnosis = Examination(messages, robot).run();
  ASSERT_FALSE(diagnosis.findings.empty());
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_frozen");
}

// A joint without an end stop, whose value goes round, and a driver that tells no slow velocity.
TEST_F(JointSpeeds, OfAJointThatTurnsOnAndOnOrWithADeadBandAreGood) {
  EXPECT_THAT(causes([](LegSample& s) { s.position[3] = std::remainder(s.position[3] + 2.9, 2 * M_PI); }),
              testing::Not(testing::Contains("joint_velocity")));
  EXPECT_THAT(causes([](LegSample& s) {
                for (double& v : s.velocity) v = std::abs(v) < 0.3 ? 0 : v;
              }),
              testing::IsEmpty());
}

TEST_F(JointSpeeds, OfOneJointThatAreAnothersAreNamed) {
  const Diagnosis diagnosis = judged([](LegSample& s) { s.velocity[3] *= -1; });
  ASSERT_EQ(diagnosis.findings.size(), 1u);
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_velocity");
}

TEST_F(JointSpeeds, OfAJointWhosePositionsAreWrongAreMendedWithIt) {
  const Diagnosis diagnosis = judged([](LegSample& s) { s.position[3] *= -1; });
  for (const Finding& finding : diagnosis.findings) {
    EXPECT_TRUE(finding.cause != "joint_velocity" || diagnosis.findings.size() == 1);
    if (!finding.cause.starts_with("joint_sign")) continue;
    EXPECT_EQ(finding.changes.back().key, "legs.velocities");
  }
}

// An encoder that jumps now and then is none whose velocities are wrong.
TEST_F(JointSpeeds, BesidePositionsThatJumpAreNotNamed) {
  int k = 0;
  const Diagnosis diagnosis = judged([&k](LegSample& s) {
    if (++k % 97 == 0) s.position[static_cast<std::size_t>(k) % s.position.size()] += 1;
  });
  for (const Finding& finding : diagnosis.findings) EXPECT_NE(finding.cause, "joint_velocity");
}

}  // namespace joint_speeds_test
}  // namespace kilvo::lab
