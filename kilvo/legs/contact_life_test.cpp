// The contact estimator when a robot changes what it does.
#include <gtest/gtest.h>
#include <vector>

#include "tests/helpers/contact_watch.hpp"

namespace kilvo {
namespace {

using test::Change;
using test::Gait;
using test::Scene;
using test::SoleMotion;

TEST(ContactEstimator, AWalkThatBecomesARunIsFollowed) {
  const Gait slow;
  Gait fast;
  fast.step = 1.2;
  fast.lift = 0.12;
  fast.stance = 0.25;
  fast.first = 0;
  ContactEstimator estimator{LegConfig{}};
  test::watch(estimator, test::walk(slow), 0, 5.5);
  const double walking = estimator.swing_speed();
  test::watch(estimator, test::standing(), 5.5, 6.0);
  // The run begins 6 s later than its own clock.
  Scene later = test::walk(fast);
  later.sole = [fast](std::size_t side, double s) { return fast.sole(side, s - 6); };
  later.body = [fast](double s) { return fast.body(s - 6); };
  std::vector<Change> run = test::watch(estimator, later, 6.0, 12.0);
  for (Change& c : run) c.s -= 6;
  test::expect_changes(fast, run, 0.5, 5.5, 0.02, 0.02);
  EXPECT_GT(estimator.swing_speed(), 1.5 * walking);
}

TEST(ContactEstimator, ARunThatBecomesASlowWalkIsFollowed) {
  Gait fast, slow;
  fast.step = 1.5;
  fast.lift = 0.15;
  fast.stance = 0.25;
  slow.step = 0.25;
  slow.lift = 0.025;
  slow.first = 0;
  ContactEstimator estimator{LegConfig{}};
  test::watch(estimator, test::walk(fast), 0, 6.02);
  ASSERT_GT(estimator.swing_speed(), 5);
  test::watch(estimator, test::standing(), 6.02, 7.0);
  Scene later = test::walk(slow);
  later.sole = [slow](std::size_t side, double s) { return slow.sole(side, s - 7); };
  later.body = [slow](double s) { return slow.body(s - 7); };
  std::vector<Change> walked = test::watch(estimator, later, 7.0, 17.0);
  for (Change& c : walked) c.s -= 7;
  test::expect_changes(slow, walked, 6.5, 9.5, 0.015, 0.015);
}

// Begun in mid-walk, the velocity wrong by more than that of the walk: whatever the phase, only feet that stand are reported as standing.
TEST(ContactEstimator, OnAnUnknownVelocityTheFootThatStandsIsFoundByWhatDoesNotChange) {
  const Gait gait;
  const Eigen::Vector3d wrong(-0.8, 0.2, 0.1);
  for (double begin = 2; begin < 2 + gait.cycle(); begin += 0.05) {
    ContactEstimator estimator{LegConfig{}};
    bool found = false;
    for (double s = begin; !found && s < begin + 0.5; s += 0.001) {
      State x = gait.body(s);
      x.v += wrong;
      const Contacts& now = estimator.update(gait.feet(s), x, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, standard_gravity), 1.0);
      for (std::size_t side = 0; side < 2; ++side) {
        if (!now.on[side]) continue;
        found = true;
        EXPECT_TRUE(gait.stands(side, s)) << "begun at " << begin << ": foot " << side << " at " << s;
      }
    }
    EXPECT_TRUE(found) << "begun at " << begin;
  }
}

TEST(ContactEstimator, TwoFeetThatDoNotMoveAgainstEachOtherBothStandAtOnce) {
  ContactEstimator estimator{LegConfig{}};
  const Scene scene = test::standing();
  State x = scene.body(0);
  Feet feet;
  feet.t = test::gait_begin;
  for (std::size_t side = 0; side < 2; ++side) feet.foot[side] = test::seen_from(x, scene.sole(side, 0));
  x.v = Eigen::Vector3d(0.5, -0.5, 0.1);
  EXPECT_EQ(estimator.update(feet, x, Eigen::Vector3d::Zero(), {0, 0, standard_gravity}, 1.0).on, (std::array<bool, 2>{true, true}));
}

TEST(ContactEstimator, OneWildSampleInASwingDoesNotMakeTheRobotFast) {
  const Gait gait;
  ContactEstimator estimator{LegConfig{}};
  Scene scene = test::walk(gait);
  scene.sole = [gait](std::size_t side, double s) {
    SoleMotion out = gait.sole(side, s);
    if (side == 0 && std::abs(s - 3.7) < 4e-4) out.v.x() += 40;
    return out;
  };
  ASSERT_FALSE(gait.stands(0, 3.7));
  const std::vector<Change> all = test::watch(estimator, scene, 0, 9);
  test::expect_changes(gait, all, 4.2, 8.45, 0.015, 0.015);
  EXPECT_LT(estimator.swing_speed(), 3);
}

TEST(ContactEstimator, ARobotThatIsAlreadyWalkingIsUnderstoodAfterItsFirstSteps) {
  const Gait gait;
  ContactEstimator estimator{LegConfig{}};
  const std::vector<Change> all = test::watch(estimator, test::walk(gait), 3.1, 9);
  ASSERT_FALSE(all.empty());
  EXPECT_FALSE(all.front().on) << "the foot in the air is noticed";
  EXPECT_LT(all.front().s, 3.11 + gait.cycle() / 2);
  test::expect_changes(gait, all, 5.9, 8.45, 0.015, 0.015);
}

// Without force nobody can tell a foot that hangs still from one that stands still: it is reported as standing, which is true of its
// velocity, and leaves again as soon as it moves.
TEST(ContactEstimator, OfALiftedRobotTheFeetLeaveAndStandWhileTheyHangStill) {
  Scene scene = test::standing();
  const auto up = [](double s) { return 0.2 * (1 - std::cos(std::numbers::pi * std::clamp(s - 1, 0.0, 1.0))); };  // 0.4 m in 1 s
  const auto rate = [](double s) { return s > 1 && s < 2 ? 0.2 * std::numbers::pi * std::sin(std::numbers::pi * (s - 1)) : 0.0; };
  scene.sole = [=](std::size_t side, double s) { return SoleMotion{{0, side == 0 ? 0.1 : -0.1, up(s)}, {0, 0, rate(s)}}; };
  scene.body = [=](double s) { return test::body_at({0, 0, 0.75 + up(s)}, {0, 0, rate(s)}); };
  ContactEstimator estimator{LegConfig{}};
  const std::vector<Change> all = test::watch(estimator, scene, 0, 4);
  ASSERT_EQ(all.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(all[i].on, i >= 2);
  EXPECT_LT(all[1].s, 1.1);
  EXPECT_GT(all[2].s, 2.15) << "not before they have hung still for 0.2 s";
  EXPECT_LT(all[3].s, 2.25);
}

}  // namespace
}  // namespace kilvo
