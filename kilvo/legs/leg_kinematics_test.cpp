#include "kilvo/legs/leg_kinematics.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

#include "tests/helpers/test_biped.hpp"

namespace kilvo {
namespace leg_kinematics_test {

using testing::AllOf;
using testing::HasSubstr;

Feet feet_of(LegKinematics& legs, const JointSample& s) {
  auto known = legs.feet(s);
  if (const auto* fault = std::get_if<std::string>(&known)) {
    ADD_FAILURE() << *fault;
    return {};
  }
  return std::get<Feet>(known);
}

std::string fault_of(LegKinematics& legs, const JointSample& s) {
  auto known = legs.feet(s);
  const auto* fault = std::get_if<std::string>(&known);
  return fault == nullptr ? "no fault" : *fault;
}

// The largest distance between corners of both.
double distance(const Feet& a, const Feet& b) {
  double worst = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(a.foot[side].corners); ++k) {
      worst = std::max({worst, (a.foot[side].p[k] - b.foot[side].p[k]).norm(), (a.foot[side].v[k] - b.foot[side].v[k]).norm()});
    }
  }
  return worst;
}

TEST(LegKinematics, CornersAreWhereAProductOfMatricesPutsThemThroughWaistMountAndPrismaticJoints) {
  test::Random random(1);
  const Robot robot = test::biped(random);
  LegKinematics legs(robot);
  for (int i = 0; i < 50; ++i) {
    const JointSample s = test::random_joints(random);
    const Feet feet = feet_of(legs, s);
    EXPECT_EQ(feet.t, s.t);
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::Isometry3d T_IF = test::foot_in_imu(robot, s, side);
      ASSERT_EQ(feet.foot[side].corners, 4);
      EXPECT_LT((feet.foot[side].R_IF.matrix() - T_IF.linear()).norm(), 1e-12);
      for (std::size_t k = 0; k < 4; ++k) EXPECT_LT((feet.foot[side].p[k] - T_IF * robot.feet[side].sole[k]).norm(), 1e-12);
    }
  }
}

// Efforts that balance a force on each foot give it back; the waist's say nothing of one foot.
TEST(LegKinematics, EffortsGiveTheForceOnEachFoot) {
  test::Random random(3);
  const Robot robot = test::biped(random);
  LegKinematics legs(robot, true);
  for (int i = 0; i < 20; ++i) {
    JointSample s = test::random_joints(random);
    EXPECT_FALSE(feet_of(legs, s).force_I);
    const std::array<Eigen::Vector3d, 2> force = {random.vector3(100), random.vector3(100)};
    const auto middle = [&](const JointSample& at, std::size_t side) {
      Eigen::Vector3d out = Eigen::Vector3d::Zero();
      for (const Eigen::Vector3d& p : robot.feet[side].sole) out += test::foot_in_imu(robot, at, side) * p / 4;
      return out;
    };
    constexpr double h = 1e-6;
    s.effort.assign(s.position.size(), 0.0);
    for (std::size_t j = 0; j < s.position.size(); ++j) {
      JointSample before = s, after = s;
      before.position[j] -= h;
      after.position[j] += h;
      for (std::size_t side = 0; side < 2; ++side) {
        s.effort[j] -= (middle(after, side) - middle(before, side)).dot(force[side]) / (2 * h);
      }
    }
    const auto known = feet_of(legs, s).force_I;
    ASSERT_TRUE(known);
    for (std::size_t side = 0; side < 2; ++side) EXPECT_LT(((*known)[side] - force[side]).norm(), 0.05 * force[side].norm());
  }
}

TEST(LegKinematics, VelocitiesAreTheDerivativesOfThePositions) {
  test::Random random(2);
  LegKinematics legs(test::biped(random));
  constexpr double h = 1e-6;
  for (int i = 0; i < 50; ++i) {
    const JointSample s = test::random_joints(random);
    const auto [before, after] = test::around(s, h);
    const Feet now = feet_of(legs, s), a = feet_of(legs, before), b = feet_of(legs, after);
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_GT(now.foot[side].v[k].norm(), 1e-3);
        EXPECT_LT((now.foot[side].v[k] - (b.foot[side].p[k] - a.foot[side].p[k]) / (2 * h)).norm(), 1e-7);
      }
    }
  }
}

TEST(LegKinematics, TheOrderOfTheJointsAndJointsOfOtherPartsChangeNoBit) {
  test::Random random(3);
  LegKinematics legs(test::biped(random));
  const JointSample s = test::random_joints(random);
  JointSample other;
  other.t = s.t;
  JointNames::List names;
  const auto put = [&other, &names](const std::string& name, double q, double dq) {
    names.push_back(name);
    other.position.push_back(q);
    other.velocity.push_back(dq);
  };
  put("elbow", std::numeric_limits<double>::quiet_NaN(), 3);
  for (std::size_t j = s.names.size(); j-- > 0;) put(s.names[j], s.position[j], s.velocity[j]);
  put("neck", 0.4, std::numeric_limits<double>::infinity());
  other.names = names;
  const Feet feet = feet_of(legs, s);
  EXPECT_EQ(distance(feet, feet_of(legs, other)), 0.0);
  EXPECT_EQ(distance(feet, feet_of(legs, s)), 0.0) << "and back again";
}

TEST(LegKinematics, AMissingJointIsNamedAndTheNextWholeMessageWorksAgain) {
  test::Random random(4);
  LegKinematics legs(test::biped(random));
  const JointSample whole = test::random_joints(random);
  const Feet feet = feet_of(legs, whole);
  JointSample s = whole;
  JointNames::List names = whole.names;
  names[7] = "right_arm";
  s.names = names;
  EXPECT_THAT(fault_of(legs, s), AllOf(HasSubstr(whole.names[7]), HasSubstr("locked_joints")));
  EXPECT_THAT(fault_of(legs, s), HasSubstr(whole.names[7])) << "the second time as well";
  EXPECT_EQ(distance(feet, feet_of(legs, whole)), 0.0);
}

TEST(LegKinematics, ALockedJointStaysAtZeroWhateverTheMessageSays) {
  test::Random random(5);
  Robot robot = test::biped(random);
  LegKinematics free(robot);
  robot.locked_joints = {"waist", "left_3"};
  LegKinematics locked(robot);
  JointSample s = test::random_joints(random);
  const Feet with = feet_of(locked, s);
  for (std::size_t j = 0; j < s.names.size(); ++j) {
    if (s.names[j] == "waist" || s.names[j] == "left_3") s.position[j] = s.velocity[j] = 0;
  }
  EXPECT_LT(distance(with, feet_of(free, s)), 1e-12);
  JointNames::List names = s.names;
  names[0] = "not_the_waist";
  s.names = names;
  EXPECT_LT(distance(with, feet_of(locked, s)), 1e-12) << "it need not be in the message";
}

TEST(LegKinematics, ALegWithoutAJointThatMovesIsRefused) {
  test::Random random(5);
  Robot robot = test::biped(random);
  robot.feet[1].link = robot.imu.link;
  EXPECT_THROW(LegKinematics{robot}, std::invalid_argument);
}

TEST(LegKinematics, AReadingOfAJointUndoesWhatTheDriverDoes) {
  test::Random random(12);
  Robot robot = test::biped(random);
  LegKinematics as_urdf(robot, true);
  JointSample s = test::random_joints(random);
  for (std::size_t j = 0; j < s.position.size(); ++j) s.effort.push_back(random.normal(10));
  JointSample driven = s;
  JointNames::List names = s.names;
  const auto place = [&](const char* joint) { return static_cast<std::size_t>(std::ranges::find(names, joint) - names.begin()); };
  const std::size_t turned = place("left_3"), off = place("right_2"), a = place("left_1"), b = place("right_1");
  for (std::vector<double>* values : {&driven.position, &driven.velocity, &driven.effort}) {
    values->at(turned) *= -1;
    std::swap(values->at(a), values->at(b));
  }
  driven.position[off] -= 0.3;
  robot.joints = {{"left_3", {"", -1, 0}}, {"right_2", {"", 1, 0.3}}, {"left_1", {"right_1", 1, 0}}, {"right_1", {"left_1", 1, 0}}};
  LegKinematics corrected(robot, true);
  const Feet expected = feet_of(as_urdf, s), feet = feet_of(corrected, driven);
  EXPECT_LT(distance(expected, feet), 1e-12);
  ASSERT_TRUE(expected.force_I && feet.force_I);
  for (std::size_t side = 0; side < 2; ++side)
    EXPECT_LT(((*expected.force_I)[side] - (*feet.force_I)[side]).norm(), 1e-9 * (*expected.force_I)[side].norm());
}

TEST(LegKinematics, WhatIsNotFiniteOrNotAsLongAsTheNamesIsRefused) {
  test::Random random(6);
  LegKinematics legs(test::biped(random));
  const JointSample whole = test::random_joints(random);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    JointSample s = whole;
    s.position[9] = bad;
    EXPECT_EQ(fault_of(legs, s), "not finite");
    s = whole;
    s.velocity[2] = bad;
    EXPECT_EQ(fault_of(legs, s), "not finite");
  }
  JointSample s = whole;
  s.names = JointNames::List(whole.names.begin(), whole.names.end() - 1);
  EXPECT_THAT(fault_of(legs, s), HasSubstr("names"));
  s.names = {};
  EXPECT_THAT(fault_of(legs, s), HasSubstr("names"));
}

TEST(LegKinematics, WithoutVelocitiesTheDifferencesApproachTheTrueOnes) {
  test::Random random(7);
  LegKinematics with(test::biped(random));
  test::Random again(7);
  LegKinematics without(test::biped(again));
  const JointSample start = test::random_joints(random);
  double first = 0, last = 0;
  for (int i = 0; i < 300; ++i) {
    JointSample s = start;
    const double time = 0.001 * i;
    s.t = start.t + std::chrono::milliseconds(i);
    for (std::size_t j = 0; j < s.position.size(); ++j) {
      s.position[j] += 0.2 * std::sin(2 * time + static_cast<double>(j));
      s.velocity[j] = 0.4 * std::cos(2 * time + static_cast<double>(j));
    }
    const Feet truth = feet_of(with, s);
    s.velocity.clear();
    if (i == 0) {
      EXPECT_THAT(fault_of(without, s), HasSubstr("velocities")) << "from one message nothing is known";
      continue;
    }
    (i == 1 ? first : last) = distance(truth, feet_of(without, s));
  }
  EXPECT_LT(first, 0.01);
  EXPECT_LT(last, 0.01);
}

TEST(LegKinematics, AJointThatGoesRoundDoesNotJump) {
  test::Random random(7);
  const Robot robot = test::biped(random);
  LegKinematics legs(robot), round(robot);
  JointSample s = test::random_joints(random);
  s.velocity.clear();
  const auto joint = static_cast<std::size_t>(std::ranges::find(s.names, "left_5") - s.names.begin());
  s.position.at(joint) = M_PI - 0.005;
  for (int i = 0; i < 20; ++i) {
    s.t += std::chrono::milliseconds(1);
    s.position[joint] += 0.001;
    JointSample within = s;
    within.position[joint] = std::remainder(s.position[joint], 2 * M_PI);
    if (i == 0) {
      EXPECT_EQ(fault_of(legs, s), fault_of(round, within));
    } else {
      EXPECT_LT(distance(feet_of(legs, s), feet_of(round, within)), 1e-9);
    }
  }
}

TEST(LegKinematics, WrongVelocitiesAreNotLookedAtWhereThoseOfThePositionsAreWanted) {
  test::Random random(7);
  Robot robot = test::biped(random);
  robot.legs.velocities = "positions";
  LegKinematics wrong(robot), none(robot);
  JointSample s = test::random_joints(random);
  for (int i = 0; i < 20; ++i) {
    s.t += std::chrono::milliseconds(1);
    for (double& q : s.position) q += 0.001;
    JointSample without = s;
    without.velocity.clear();
    if (i > 0) {
      EXPECT_EQ(distance(feet_of(wrong, s), feet_of(none, without)), 0);
    } else {
      EXPECT_EQ(fault_of(wrong, s), fault_of(none, without));
    }
  }
}

TEST(LegKinematics, WithoutVelocitiesAGapOrAnotherOrderOfTheJointsIsNoMotion) {
  test::Random random(11);
  LegKinematics legs(test::biped(random));
  JointSample s = test::random_joints(random);
  s.velocity.clear();
  EXPECT_THAT(fault_of(legs, s), HasSubstr("velocities"));
  s.t += std::chrono::milliseconds(1);
  EXPECT_LT(feet_of(legs, s).foot[0].v[0].norm(), 1e-12);
  s.t += std::chrono::milliseconds(1);
  s.names = JointNames::List(s.names.list().rbegin(), s.names.list().rend());
  std::reverse(s.position.begin(), s.position.end());
  EXPECT_THAT(fault_of(legs, s), HasSubstr("velocities"));
  s.t += std::chrono::milliseconds(1);
  EXPECT_LT(feet_of(legs, s).foot[0].v[0].norm(), 1e-12);
  s.t += std::chrono::milliseconds(500);
  for (double& q : s.position) q += 0.3;
  EXPECT_THAT(fault_of(legs, s), HasSubstr("velocities"));
  s.t += std::chrono::milliseconds(1);
  EXPECT_LT(feet_of(legs, s).foot[0].v[0].norm(), 1e-12);
}

TEST(LegKinematics, ANonFiniteMessageDoesNotPoisonTheVelocitiesAfterIt) {
  test::Random random(8);
  LegKinematics legs(test::biped(random));
  JointSample s = test::random_joints(random);
  s.velocity.clear();
  double speed = 1;
  for (int i = 0; i < 60; ++i) {
    s.t += std::chrono::milliseconds(1);
    JointSample bad = s;
    if (i == 5) bad.position[4] = std::numeric_limits<double>::quiet_NaN();
    auto known = legs.feet(bad);
    if (i == 5) {
      EXPECT_EQ(std::get<std::string>(known), "not finite");
    }
    if (i > 6) {
      ASSERT_TRUE(std::holds_alternative<Feet>(known)) << "message " << i;
      speed = std::get<Feet>(known).foot[0].v[0].norm();
    }
  }
  EXPECT_LT(speed, 1e-9);
}

TEST(LegKinematics, TheTwoFeetMessageIsTurnedMovedAndLoweredToTheSole) {
  Robot robot;
  robot.legs.type = "feet";
  robot.legs.sole_offset = 0.05;
  robot.legs.T_imu_feet = {SO3::Exp({3.14159265358979, 0, 0}), {0.1, 0.2, 0.3}};  // z down, as in the head of a robot
  LegKinematics legs(robot);
  JointSample s;
  s.position = {1, 2, -3, 4, 5, -6};
  s.velocity = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const Feet feet = feet_of(legs, s);
  EXPECT_EQ(feet.foot[0].corners, 1);
  EXPECT_LT((feet.foot[0].p[0] - Eigen::Vector3d(1.1, -1.8, 3.35)).norm(), 1e-12);
  EXPECT_LT((feet.foot[1].p[0] - Eigen::Vector3d(4.1, -4.8, 6.35)).norm(), 1e-12);
  EXPECT_LT((feet.foot[0].v[0] - Eigen::Vector3d(0.1, -0.2, -0.3)).norm(), 1e-12);
  EXPECT_LT((feet.foot[1].v[0] - Eigen::Vector3d(0.4, -0.5, -0.6)).norm(), 1e-12);
  s.position.pop_back();
  EXPECT_THAT(fault_of(legs, s), HasSubstr("six"));
}

}  // namespace leg_kinematics_test
}  // namespace kilvo
