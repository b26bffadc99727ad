#include "kilvo/legs/contact_estimator.hpp"

#include <gtest/gtest.h>
#include <vector>

#include "tests/helpers/contact_watch.hpp"

namespace kilvo {
namespace contact_estimator_test {

using test::Change;
using test::Gait;
using test::Scene;
using test::SoleMotion;

TEST(ContactEstimator, FindsEachLiftOffAndTouchdownWithin30MillisecondsAtAnySpeedOfAnyRobot) {
  for (const double leg : {0.4, 0.75, 1.2}) {
    for (const double scale : {0.5, 1.0, 1.7, 3.0}) {
      SCOPED_TRACE(testing::Message() << "leg " << leg << " m, scale " << scale);
      Gait gait;
      gait.leg = leg;
      gait.step *= scale;
      gait.lift *= scale;
      test::expect_changes(gait, test::watch(test::walk(gait), 9), 4.2, 8.45, 0.03, 0.03);
    }
  }
}

TEST(ContactEstimator, NoStepIsMissedOrSeenTwiceFromTheFirstOneOn) {
  for (const double scale : {0.5, 1.0, 3.0}) {
    SCOPED_TRACE(scale);
    Gait gait;
    gait.step *= scale;
    gait.lift *= scale;
    test::expect_changes(gait, test::watch(test::walk(gait), 6), 0.5, 5.5, 0.06, 0.06);
  }
}

TEST(ContactEstimator, AtLowerRatesChangesAreFoundThreeSamplesAfterTheyCanBeSeen) {
  for (const double rate : {2000.0, 500.0, 200.0, 100.0}) {
    SCOPED_TRACE(rate);
    const Gait gait;
    test::expect_changes(gait, test::watch(test::walk(gait), 9, rate), 4.2, 8.45, 0.03, 0.03 + 3 / rate);
  }
}

TEST(ContactEstimator, TheSlowApexOfASwingInPlaceIsNoTouchdown) {
  for (const double lift : {0.05, 0.1, 0.2}) {
    SCOPED_TRACE(lift);
    Gait gait;
    gait.step = 0;
    gait.lift = lift;
    gait.swing = 0.5;
    gait.stance = 0.6;
    // Rising without a jerk: after 30 ms a tenth of the swing's speed is reached.
    test::expect_changes(gait, test::watch(test::walk(gait), 10), 4.2, 9.45, 0.04, 0.05);
  }
}

TEST(ContactEstimator, StandingWithNoisyVelocitiesNeverLifts) {
  Scene scene = test::standing();
  scene.velocity_noise = 0.02;
  EXPECT_TRUE(test::watch(scene, 20).empty());
}

TEST(ContactEstimator, AWildSampleIsNoLiftOff) {
  for (const double rate : {2000.0, 1000.0, 100.0}) {
    SCOPED_TRACE(rate);
    Scene scene = test::standing();
    scene.sole = [=](std::size_t side, double s) {
      const double samples = (s - 2) * rate;
      const bool off = samples > -0.5 && samples < 0.5;
      return SoleMotion{{0, side == 0 ? 0.1 : -0.1, 0}, {off ? 3.0 : 0.0, 0, 0}};
    };
    EXPECT_TRUE(test::watch(scene, 2.1, rate).empty());
  }
}

TEST(ContactEstimator, SoftGroundThatThrowsAFootUpByFiveMillimetresIsNoLiftOff) {
  const Gait gait;
  Scene scene = test::walk(gait);
  constexpr double lasts = 0.05, height = 0.005;
  scene.sole = [gait](std::size_t side, double s) {
    SoleMotion out = gait.sole(side, s);
    const double swung = gait.swinging(side, s - lasts);
    if (swung < 0 || !gait.stands(side, s)) return out;
    const double u = (swung + lasts - gait.swing) / lasts;  // since touchdown
    out.p.z() += height * std::sin(std::numbers::pi * u);
    out.v.z() += height * std::numbers::pi / lasts * std::cos(std::numbers::pi * u);
    return out;
  };
  test::expect_changes(gait, test::watch(scene, 9), 4.2, 8.45, 0.03, 0.03);
}

TEST(ContactEstimator, ARestartForgetsTheFeetButNotTheRobot) {
  ContactEstimator estimator;
  const Gait gait;
  test::watch(estimator, test::walk(gait), 0, 6.25);
  ASSERT_FALSE(estimator.contacts().on[0] && estimator.contacts().on[1]);
  const double speed = estimator.contacts().sole_speed;
  estimator.restart();
  EXPECT_TRUE(test::watch(estimator, test::standing(), 7, 8).empty()) << "both stand until they move";
  EXPECT_TRUE(estimator.contacts().on[0] && estimator.contacts().on[1]);
  EXPECT_NEAR(estimator.contacts().sole_speed, speed, 1e-9) << "standing teaches nothing";
  EXPECT_GT(estimator.contacts().phase(0), 1.0);
}

TEST(ContactEstimator, SaysHowSurelyEachFootStands) {
  const Gait gait;
  ContactEstimator estimator;
  test::watch(estimator, test::walk(gait), 0, gait.first + gait.cycle() * 3 + gait.swing / 2);
  EXPECT_LT(estimator.contacts().probability[0], 0.05);
  EXPECT_GT(estimator.contacts().probability[1], 0.95);
  EXPECT_FALSE(estimator.contacts().flight);
}

TEST(ContactEstimator, ClearanceIsTheHeightOverTheLastPlaceOfTheFoot) {
  const Gait gait;
  const double apex = gait.first + gait.cycle() * 3 + gait.swing * 2 / 3;
  ContactEstimator estimator;
  test::watch(estimator, test::walk(gait), 0, apex);
  EXPECT_NEAR(estimator.contacts().clearance[0], gait.lift, 0.003);
  EXPECT_NEAR(estimator.contacts().clearance[1], 0, 1e-9);
  EXPECT_GT(estimator.contacts().d_fv[0], 10) << "it moves";
  EXPECT_LT(estimator.contacts().d_fv[1], 1) << "it stands";
}

}  // namespace contact_estimator_test
}  // namespace kilvo
