// What a hypothesis does to the messages, and the setting that does the same.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/doctor/leg_hypotheses.hpp"
#include "lab/settings/settings.hpp"
#include "tests/helpers/test_biped.hpp"

namespace kilvo::lab {
namespace leg_changes_test {

Recorded some_messages(test::Random& random) {
  Recorded out;
  for (int i = 0; i < 5; ++i) {
    const JointSample s = test::random_joints(random);
    out.joint_names = JointNames::List(s.names.begin(), s.names.end());
    out.legs.push_back({0.1 * i, s.position, s.velocity});
  }
  return out;
}

Robot changed(Robot robot, const std::vector<Change>& changes) {
  for (const Change& change : changes) {
    EXPECT_EQ(change.key, "robot.joints");
    robot.joints = parse_settings("robot: {joints: " + change.value + "}", "changed", ".").robot.joints;
  }
  return robot;
}

// The largest distance between corners of the soles, m.
double distance(const std::vector<LegPose>& a, const std::vector<LegPose>& b) {
  double worst = a.size() == b.size() && !a.empty() ? 0 : INFINITY;
  for (std::size_t i = 0; worst < INFINITY && i < a.size(); ++i) {
    for (std::size_t f = 0; f < 2; ++f) {
      for (std::size_t k = 0; k < static_cast<std::size_t>(a[i].foot[f].corners); ++k)
        worst = std::max(worst, (a[i].foot[f].p[k] - b[i].foot[f].p[k]).norm());
    }
  }
  return worst;
}

TEST(LegChanges, RobotJointsDoToTheMessagesWhatEachHypothesisDoes) {
  constexpr double rounding = 3e-4;  // m: a zero is written with four decimals
  test::Random random(7);
  Robot robot = test::biped(random);
  const Recorded recorded = some_messages(random);
  RecordedLegs legs(recorded);
  std::size_t tried = 0;
  for (const bool corrected_before : {false, true}) {
    if (corrected_before) robot.joints = {{"left_2", {"", -1, 0.3}}, {"left_1", {"right_1", 1, 0}}, {"right_1", {"left_1", 1, 0}}};
    std::vector<LegHypothesis> all = leg_hypotheses(legs, robot);
    for (LegHypothesis& h : gross_leg_hypotheses(legs, robot)) all.push_back(std::move(h));
    all.push_back(joined(all.front(), all.back()));
    for (const LegHypothesis& h : all) {
      if (!h.names && !h.position) continue;
      ++tried;
      const Robot after = changed(robot, changes_of(legs, robot, h));
      EXPECT_LT(distance(legs.path(robot, &h, 0, nullptr), legs.path(after, nullptr, 0, nullptr)), rounding) << h.name;
    }
  }
  EXPECT_GT(tried, 100U);
}

TEST(LegChanges, AJointWhoseMessageAnotherOneReadsAsWellIsChangedItself) {
  test::Random random(7);
  Robot robot = test::biped(random);
  robot.joints = {{"left_2", {"left_4", 1, 0}}, {"left_4", {"", -1, 0}}};
  const Recorded recorded = some_messages(random);
  RecordedLegs legs(recorded);
  LegHypothesis h;
  h.position = [place = std::ranges::find(recorded.joint_names, "left_4") - recorded.joint_names.begin()](std::size_t i, double& q) {
    if (static_cast<std::ptrdiff_t>(i) == place) q = -q;
  };
  const Robot after = changed(robot, changes_of(legs, robot, h));
  EXPECT_LT(distance(legs.path(robot, &h, 0, nullptr), legs.path(after, nullptr, 0, nullptr)), 1e-9);
}

TEST(LegChanges, AnotherUnitOrAnotherLinkIsNoReadingOfAJoint) {
  test::Random random(7);
  const Robot robot = test::biped(random);
  const Recorded recorded = some_messages(random);
  RecordedLegs legs(recorded);
  EXPECT_TRUE(changes_of(legs, robot, degrees_hypothesis()).empty());
  EXPECT_TRUE(changes_of(legs, robot, size_hypotheses().front()).empty());
}

TEST(LegChanges, FeetAreWrittenAsTheyAreRead) {
  test::Random random(7);
  const Robot robot = test::biped(random);
  const Settings settings = parse_settings("robot: {feet: " + feet_text(robot.feet) + "}", "feet", ".");
  for (std::size_t side = 0; side < 2; ++side) {
    EXPECT_EQ(settings.robot.feet[side].name, robot.feet[side].name);
    EXPECT_EQ(settings.robot.feet[side].link, robot.feet[side].link);
    ASSERT_EQ(settings.robot.feet[side].sole.size(), robot.feet[side].sole.size());
    for (std::size_t k = 0; k < robot.feet[side].sole.size(); ++k)
      EXPECT_LT((settings.robot.feet[side].sole[k] - robot.feet[side].sole[k]).norm(), 1e-5);
  }
}

}  // namespace leg_changes_test
}  // namespace kilvo::lab
