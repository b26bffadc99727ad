#include "lab/clocks/link_kinematics.hpp"

#include <gtest/gtest.h>
#include <limits>

#include "tests/helpers/test_biped.hpp"

namespace kilvo::lab {
namespace link_kinematics_test {

TEST(LinkKinematics, AFootIsWhereAProductOfMatricesPutsIt) {
  test::Random random(1);
  const Robot robot = test::biped(random);
  LinkKinematics foot(robot, "left_foot");
  for (int i = 0; i < 20; ++i) {
    const JointSample s = test::random_joints(random);
    const Eigen::Isometry3d truth = test::foot_in_imu(robot, s, 0);
    const auto known = foot.at(s);
    ASSERT_TRUE(known);
    EXPECT_LT((known->T_IL.p - truth.translation()).norm(), 1e-12);
    EXPECT_LT((known->T_IL.R.matrix() - truth.linear()).norm(), 1e-12);
  }
}

TEST(LinkKinematics, ThePelvisMovesAsItsPosesDo) {
  test::Random random(2);
  LinkKinematics pelvis(test::biped(random), "pelvis");
  constexpr double h = 1e-6;
  for (int i = 0; i < 20; ++i) {
    const JointSample s = test::random_joints(random);
    const auto [before, after] = test::around(s, h);
    const LinkMotion now = *pelvis.at(s), a = *pelvis.at(before), b = *pelvis.at(after);
    EXPECT_GT(now.omega.norm(), 1e-3);
    EXPECT_LT((now.v - (b.T_IL.p - a.T_IL.p) / (2 * h)).norm(), 1e-7);
    EXPECT_LT((now.omega - (b.T_IL.R * a.T_IL.R.inverse()).Log() / (2 * h)).norm(), 1e-7);
  }
}

TEST(LinkKinematics, LockedJointsMakeItRigidAndMissingOnesUnknown) {
  test::Random random(3);
  Robot robot = test::biped(random);
  LinkKinematics through_waist(robot, "pelvis");
  EXPECT_FALSE(through_waist.is_rigid());
  EXPECT_EQ(through_waist.first_joint(), "waist");
  JointSample s = test::random_joints(random);
  JointSample without;
  EXPECT_FALSE(through_waist.at(without));
  for (double& q : s.position) q = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(through_waist.at(s));
  robot.locked_joints = {"waist"};
  LinkKinematics rigid(robot, "pelvis");
  ASSERT_TRUE(rigid.is_rigid());
  EXPECT_LT((rigid.at_rest().T_IL.p - rigid.at(without)->T_IL.p).norm(), 1e-15);
  EXPECT_THROW(LinkKinematics(robot, "tail"), std::invalid_argument);
}

}  // namespace link_kinematics_test
}  // namespace kilvo::lab
