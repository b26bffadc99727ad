#include "kilvo/legs/level_ground.hpp"

#include <gtest/gtest.h>
#include <random>

#include "kilvo/math/so3.hpp"

namespace kilvo {
namespace level_ground_test {

// A robot that sets down one foot after the other, 0.3 m along x and 0.2 m across, as its legs measure that.
class GroundWalk {
 public:
  double climb = 0;            // per metre of the way in the robot's frame: what the legs measure too much
  double slope = 0;            // of the ground along x of the world, true
  double heading = 0;          // rad
  double tilt_sigma = 0.0005;  // of the vertical, rad
  double height_sigma = 0;     // m

  // Half of the height of each foothold over the ground that is reported is corrected.
  std::optional<GroundPatch> walk(int steps) {
    std::optional<GroundPatch> out;
    for (int i = 0; i < steps; ++i) {
      const std::size_t side = static_cast<std::size_t>(++count_ % 2);
      const SO3 R = SO3::Exp({0, 0, heading});
      const Eigen::Vector3d step_I(0.3, side == 0 ? 0.2 : -0.2, 0);
      const Eigen::Vector3d step_W = R * step_I;
      true_height += slope * step_W.x();
      foothold += step_W + Eigen::Vector3d(0, 0, slope * step_W.x() + climb * step_I.x() + noise_(random_));
      Estimate e;
      e.t = Time(from_seconds(0.4 * count_));
      e.x.R = R;
      e.x.g = {0, 0, -9.81};
      e.P.setZero();
      e.P.diagonal().segment<3>(at::g).setConstant(9.81 * 9.81 * tilt_sigma * tilt_sigma);
      e.P(at::p + 2, at::p + 2) = height_sigma * height_sigma;
      out = ground.touchdown(side, foothold, e);
      if (out) foothold.z() -= 0.5 * out->height_of(foothold);
      ground.stands_at(side, foothold);
    }
    return out;
  }

  LevelGround ground;
  Eigen::Vector3d foothold = Eigen::Vector3d::Zero();
  double true_height = 0;

 private:
  int count_ = 0;
  std::mt19937_64 random_{7};
  std::normal_distribution<double> noise_{0, 0.003};
};

// One per cent of climb, as of an IMU that is pitched by 0.6 degrees: 180 mm on the way without the ground, 18 allowed.
TEST(LevelGround, HoldsTheHeightOfARobotThatIsDescribedAsPitched) {
  GroundWalk walk;
  walk.climb = 0.01;
  EXPECT_TRUE(walk.walk(60));
  EXPECT_LT(std::abs(walk.foothold.z()), 0.018);
}

TEST(LevelGround, ASlopeIsNoLevelGround) {
  GroundWalk walk;
  walk.walk(20);
  walk.slope = 0.1;
  walk.walk(3);
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(walk.walk(1)) << i;
  EXPECT_NEAR(walk.foothold.z(), walk.true_height, 0.05 * walk.true_height);
}

// 2 % might be a wrong description, and are taken for that; 5 % are more than descriptions are off by.
TEST(LevelGround, ARobotThatBeginsOnASlopeIsNotTakenForOneThatIsPitched) {
  GroundWalk walk;
  walk.slope = 0.05;
  walk.walk(10);
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(walk.walk(1)) << i;
  EXPECT_NEAR(walk.foothold.z(), walk.true_height, 0.05 * walk.true_height);
}

TEST(LevelGround, AStairLeadsToAnotherFloor) {
  GroundWalk walk;
  const auto below = walk.walk(20);
  ASSERT_TRUE(below);
  walk.foothold.z() += 0.15;
  EXPECT_FALSE(walk.walk(1));
  const auto above = walk.walk(15);
  ASSERT_TRUE(above);
  EXPECT_NEAR(above->point.z() - below->point.z(), 0.15, 0.015);
}

// Until the vertical is settled the ground tells of gravity, too; the world is levelled by what it is after 14 s of walking at the latest.
TEST(LevelGround, SettlesTheVerticalWhenGravityIsKnownOrAfterAWhile) {
  GroundWalk known, unknown;
  known.walk(10);
  EXPECT_TRUE(known.ground.vertical());
  EXPECT_FALSE(known.walk(1)->measures_gravity);
  unknown.tilt_sigma = 0.005;
  EXPECT_TRUE(unknown.walk(30)->measures_gravity);
  EXPECT_FALSE(unknown.ground.vertical()) << "12 s";
  EXPECT_FALSE(unknown.walk(10)->measures_gravity);
  EXPECT_TRUE(unknown.ground.vertical());
}

// The rows of a floor hold the height over it; what was not known of the height when it began stays unknown.
TEST(LevelGround, TheHeightOfAFloorIsAsUncertainAsItWasWhenTheFloorWasBegun) {
  GroundWalk walk;
  walk.walk(20);
  EXPECT_EQ(walk.ground.floor_variance(), 0);
  walk.height_sigma = 0.05;
  walk.foothold.z() += 0.15;
  walk.walk(15);
  EXPECT_NEAR(walk.ground.floor_variance(), 0.05 * 0.05, 1e-4);
  walk.height_sigma = 0.01;
  walk.walk(15);
  EXPECT_NEAR(walk.ground.floor_variance(), 0.05 * 0.05, 1e-4) << "its rows do not measure it";
  walk.ground.height_is_measured();
  EXPECT_EQ(walk.ground.floor_variance(), 0);
}

TEST(LevelGround, NothingIsLeftOfAFloorAfterARestart) {
  GroundWalk walk;
  ASSERT_TRUE(walk.walk(20));
  walk.foothold.z() += 1;
  walk.ground.restart();
  const auto patch = walk.walk(1);
  EXPECT_TRUE(!patch || patch->point.z() > 0.9);
}

}  // namespace level_ground_test
}  // namespace kilvo
