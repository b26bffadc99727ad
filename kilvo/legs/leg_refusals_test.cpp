// Robots whose legs cannot be used.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <stdexcept>

#include "kilvo/legs/joint_chain.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "tests/helpers/test_biped.hpp"

namespace kilvo {
namespace leg_refusals_test {

using testing::AllOf;
using testing::HasSubstr;

std::string refusal_of(const Robot& robot) {
  try {
    const LegKinematics legs(robot);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "no exception";
}

TEST(LegKinematics, ARobotThatCannotBeUsedIsRefusedByTheNameOfWhatIsWrong) {
  test::Random random(9);
  const Robot good = test::biped(random);
  EXPECT_EQ(refusal_of(good), "no exception");
  Robot robot = good;
  robot.urdf.clear();
  EXPECT_THAT(refusal_of(robot), HasSubstr("robot.urdf"));
  for (const char* garbage : {"no xml", "<robot/>", "<robot name=\"x\"></robot>", "<robot name=\"x\"><link name=\"a\">"}) {
    robot.urdf = garbage;
    EXPECT_THAT(refusal_of(robot), HasSubstr("robot.urdf")) << garbage;
  }
  robot = good;
  robot.feet[1].link = "hoof";
  EXPECT_THAT(refusal_of(robot), HasSubstr("hoof"));
  robot = good;
  robot.imu.link = "hat";
  EXPECT_THAT(refusal_of(robot), HasSubstr("hat"));
  for (const std::size_t corners : {std::size_t{0}, std::size_t{max_corners + 1}}) {
    robot = good;
    robot.feet[0].sole.assign(corners, Eigen::Vector3d::Zero());
    EXPECT_THAT(refusal_of(robot), AllOf(HasSubstr("left"), HasSubstr("sole")));
  }
}

TEST(LegKinematics, WhatTheUrdfParserSaysIsInTheErrorAndNotOnTheScreen) {
  test::Random random(9);
  Robot robot = test::biped(random);
  const std::string joint = "<joint name=\"left_3\"";
  robot.urdf.replace(robot.urdf.find(joint), joint.size(), "<joint nome=\"left_3\"");
  testing::internal::CaptureStderr();
  const std::string refusal = refusal_of(robot);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(refusal, AllOf(HasSubstr("robot.urdf"), HasSubstr("joint")));
}

TEST(LegKinematics, MessagesOfAnotherRobotAreToldFromDamagedOnes) {
  test::Random random(9);
  const Robot robot = test::biped(random);
  const LegKinematics legs(robot);
  JointSample s = test::random_joints(random);
  EXPECT_EQ(legs.mismatch(s), std::nullopt);
  s.position[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(legs.mismatch(s), std::nullopt) << "a bad value is not another robot";
  JointNames::List names = s.names;
  *std::ranges::find(names, "left_3") = "tail";
  s.names = names;
  EXPECT_THAT(legs.mismatch(s).value_or(""), AllOf(HasSubstr("left_3"), HasSubstr("locked_joints")));
}

TEST(LegKinematics, TwoFeetAreSixPositionsAndNotTwelveAngles) {
  Robot robot;
  robot.legs.type = "feet";
  LegKinematics legs(robot);
  JointSample s;
  s.position.assign(12, 0.1);
  s.velocity.assign(12, 0.0);
  EXPECT_THAT(legs.mismatch(s).value_or(""), AllOf(HasSubstr("feet"), HasSubstr("12")));
  EXPECT_TRUE(std::holds_alternative<std::string>(legs.feet(s)));
  s.position.resize(6);
  s.velocity.resize(6);
  EXPECT_EQ(legs.mismatch(s), std::nullopt);
  EXPECT_TRUE(std::holds_alternative<Feet>(legs.feet(s)));
}

// `by` in place of `what` in its URDF.
Robot biped_with(const std::string& what, const std::string& by) {
  test::Random random(10);
  Robot robot = test::biped(random);
  const auto where = robot.urdf.find(what);
  EXPECT_NE(where, std::string::npos) << what;
  if (where != std::string::npos) robot.urdf.replace(where, what.size(), by);
  return robot;
}

TEST(LegKinematics, AFloatingJointOnTheWayIsRefusedUnlessItIsLocked) {
  Robot robot = biped_with("<joint name=\"left_3\" type=\"prismatic\">", "<joint name=\"left_3\" type=\"floating\">");
  EXPECT_THAT(refusal_of(robot), HasSubstr("left_3"));
  robot.locked_joints = {"left_3"};
  EXPECT_EQ(refusal_of(robot), "no exception");
}

// The URDFs of many humanoids begin with a world, for simulators.
TEST(LegKinematics, AWorldInWhichTheRobotFloatsIsNoPartOfIt) {
  const Robot robot = biped_with("<link name=\"pelvis\"/>",
                                 "<link name=\"world\"/><link name=\"pelvis\"/><joint name=\"floating_base\" type=\"floating\">"
                                 "<parent link=\"world\"/><child link=\"pelvis\"/></joint>");
  EXPECT_EQ(refusal_of(robot), "no exception");
  EXPECT_EQ(LinkTree(robot).root(), "pelvis");
  EXPECT_FALSE(LinkTree(robot).has("world"));
}

}  // namespace leg_refusals_test
}  // namespace kilvo
