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
  static Diagnosis judged(const std::function<void(LegSample&)>& change) {
    Recorded changed = recorded();
    for (LegSample& s : changed.legs) change(s);
    const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
    Robot robot = parse_settings(simulated_config(config(), urdf), "simulated", ".").robot;
    robot.urdf = urdf_of(config().shape);
    return Examination(changed, robot).run();
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
TEST_F(JointSpeeds, OfNoiseAreNotJudged) {
  int k = 0;
  EXPECT_THAT(causes([&k](LegSample& s) {
                for (double& v : s.velocity) v = 5 * std::sin(++k * 12.9898);
              }),
              testing::IsEmpty());
}

}  // namespace joint_speeds_test
}  // namespace kilvo::lab
