// The contact estimator when a robot changes what it does.
#include <gtest/gtest.h>
#include <vector>

#include "tests/helpers/contact_watch.hpp"

namespace kilvo {
namespace contact_life_test {

using test::Change;
using test::Gait;
using test::Scene;
using test::SoleMotion;

TEST(ContactEstimator, AWalkThatBecomesAFastOneIsFollowed) {
  const Gait slow;
  Gait fast;
  fast.step = 1.2;
  fast.lift = 0.12;
  fast.stance = 0.4;
  fast.first = 0;
  ContactEstimator estimator;
  test::watch(estimator, test::walk(slow), 0, 5.5);
  test::watch(estimator, test::standing(), 5.5, 6.0);
  // The run begins 6 s later than its own clock.
  Scene later = test::walk(fast);
  later.sole = [fast](std::size_t side, double s) { return fast.sole(side, s - 6); };
  later.body = [fast](double s) { return fast.body(s - 6); };
  std::vector<Change> run = test::watch(estimator, later, 6.0, 12.0);
  for (Change& c : run) c.s -= 6;
  test::expect_changes(fast, run, 1.6, 5.4, 0.03, 0.03);
}

TEST(ContactEstimator, ARunThatBecomesASlowWalkIsFollowed) {
  Gait fast, slow;
  fast.step = 1.5;
  fast.lift = 0.15;
  fast.stance = 0.25;
  slow.step = 0.25;
  slow.lift = 0.025;
  slow.first = 0;
  ContactEstimator estimator;
  test::watch(estimator, test::walk(fast), 0, 6.02);
  test::watch(estimator, test::standing(), 6.02, 7.0);
  Scene later = test::walk(slow);
  later.sole = [slow](std::size_t side, double s) { return slow.sole(side, s - 7); };
  later.body = [slow](double s) { return slow.body(s - 7); };
  std::vector<Change> walked = test::watch(estimator, later, 7.0, 17.0);
  for (Change& c : walked) c.s -= 7;
  test::expect_changes(slow, walked, 6.5, 9.5, 0.03, 0.04);
}

// Begun in mid-walk, the velocity wrong by more than that of the walk: what is left are the heights of the feet.
TEST(ContactEstimator, OnAnUnknownVelocityMostIsFoundByWhatDoesNotNeedIt) {
  const Gait gait;
  ContactEstimator estimator;
  double right = 0, all = 0;
  for (double s = 2; s < 8; s += 0.001) {
    State x = gait.body(s);
    x.v += Eigen::Vector3d(-0.8, 0.2, 0);
    const Contacts& now = estimator.update(gait.feet(s), x, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, standard_gravity), 1.0);
    for (std::size_t side = 0; side < 2 && s > 4; ++side) {
      right += now.on[side] == gait.stands(side, s) ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(right / all, 0.85);
}

TEST(ContactEstimator, ARobotThatIsAlreadyWalkingIsUnderstoodAfterItsFirstSteps) {
  const Gait gait;
  ContactEstimator estimator;
  const std::vector<Change> all = test::watch(estimator, test::walk(gait), 3.1, 9);
  ASSERT_FALSE(all.empty());
  EXPECT_FALSE(all.front().on) << "the foot in the air is noticed";
  EXPECT_LT(all.front().s, 3.11 + gait.cycle() / 2);
  test::expect_changes(gait, all, 5.9, 8.45, 0.03, 0.03);
}

}  // namespace contact_life_test
}  // namespace kilvo
