// Robots whose legs cannot be used.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>

#include "kilvo/legs/leg_kinematics.hpp"
#include "tests/helpers/test_biped.hpp"

namespace kilvo {
namespace {

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

TEST(LegKinematics, AFloatingJointOnTheWayIsRefusedUnlessItIsLocked) {
  test::Random random(10);
  Robot robot = test::biped(random);
  const std::string revolute = "<joint name=\"left_3\" type=\"prismatic\">";
  const auto where = robot.urdf.find(revolute);
  ASSERT_NE(where, std::string::npos);
  robot.urdf.replace(where, revolute.size(), "<joint name=\"left_3\" type=\"floating\">");
  EXPECT_THAT(refusal_of(robot), HasSubstr("left_3"));
  robot.locked_joints = {"left_3"};
  EXPECT_EQ(refusal_of(robot), "no exception");
}

}  // namespace
}  // namespace kilvo
