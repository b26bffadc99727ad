#include "kilvo/legs/contact_estimator.hpp"

#include <gtest/gtest.h>
#include <vector>

#include "tests/helpers/contact_watch.hpp"

namespace kilvo {
namespace {

using test::Change;
using test::Gait;
using test::Scene;
using test::SoleMotion;

TEST(ContactEstimator, FindsEachLiftOffAndTouchdownWithin15MillisecondsAtAnySpeedOfAnyRobot) {
  for (const double leg : {0.4, 0.75, 1.2}) {
    for (const double scale : {0.5, 1.0, 1.7, 3.0}) {
      SCOPED_TRACE(testing::Message() << "leg " << leg << " m, scale " << scale);
      Gait gait;
      gait.leg = leg;
      gait.step *= scale;
      gait.lift *= scale;
      test::expect_changes(gait, test::watch(test::walk(gait), 9), 4.2, 8.45, 0.015, 0.015);
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
  for (const double rate : {200.0, 100.0}) {
    SCOPED_TRACE(rate);
    const Gait gait;
    // A foot that leaves is faster than a tenth of its swing after 11 ms.
    test::expect_changes(gait, test::watch(test::walk(gait), 9, rate), 4.2, 8.45, 0.015, 0.011 + 3 / rate);
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
    test::expect_changes(gait, test::watch(test::walk(gait), 10), 4.2, 9.45, 0.02, 0.035);
  }
}

TEST(ContactEstimator, StandingWithNoisyVelocitiesNeverLifts) {
  Scene scene = test::standing();
  scene.velocity_noise = 0.02;
  EXPECT_TRUE(test::watch(scene, 20).empty());
}

TEST(ContactEstimator, OneOrTwoWildSamplesAreNoLiftOff) {
  for (const double rate : {1000.0, 100.0}) {
    for (const int wild : {1, 2, 4}) {
      SCOPED_TRACE(testing::Message() << wild << " samples at " << rate << " Hz");
      Scene scene = test::standing();
      scene.sole = [=](std::size_t side, double s) {
        const double samples = (s - 2) * rate;
        const bool off = samples > -0.5 && samples < wild - 0.5;
        return SoleMotion{{0, side == 0 ? 0.1 : -0.1, 0}, {off ? 3.0 : 0.0, 0, 0}};
      };
      EXPECT_EQ(test::watch(scene, 2.1, rate).empty(), wild <= 2);
    }
  }
}

TEST(ContactEstimator, AFootThatSlidesSlowlyStaysOn) {
  ContactEstimator estimator{LegConfig{}};
  const Gait gait;
  test::watch(estimator, test::walk(gait), 0, 6.5);
  const double slide = 0.05 * estimator.swing_speed();
  Scene scene = test::standing();
  scene.sole = [=](std::size_t side, double s) {
    SoleMotion out{{0, side == 0 ? 0.1 : -0.1, 0}};
    if (side == 1) return out;
    out.p.x() = slide * (s - 7.2);
    out.v.x() = slide;
    return out;
  };
  test::watch(estimator, test::standing(), 6.5, 7.2);
  EXPECT_TRUE(test::watch(estimator, scene, 7.2, 9).empty());
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
  test::expect_changes(gait, test::watch(scene, 9), 4.2, 8.45, 0.015, 0.015);
}

TEST(ContactEstimator, ARestartForgetsTheFeetButNotTheRobot) {
  ContactEstimator estimator{LegConfig{}};
  const Gait gait;
  test::watch(estimator, test::walk(gait), 0, 6.25);
  ASSERT_FALSE(estimator.contacts().on[0] && estimator.contacts().on[1]);
  const double speed = estimator.swing_speed();
  estimator.restart();
  EXPECT_TRUE(test::watch(estimator, test::standing(), 7, 8).empty()) << "both stand until they move";
  EXPECT_TRUE(estimator.contacts().on[0] && estimator.contacts().on[1]);
  EXPECT_EQ(estimator.swing_speed(), speed);
  EXPECT_GT(estimator.contacts().phase(0), 1.0);
}

TEST(ContactEstimator, ClearanceIsTheHeightOverTheLastPlaceOfTheFoot) {
  const Gait gait;
  const double apex = gait.first + gait.cycle() * 3 + gait.swing * 2 / 3;
  ContactEstimator estimator{LegConfig{}};
  test::watch(estimator, test::walk(gait), 0, apex);
  EXPECT_NEAR(estimator.contacts().clearance[0], gait.lift, 0.003);
  EXPECT_NEAR(estimator.contacts().clearance[1], 0, 1e-9);
  EXPECT_GT(estimator.contacts().d_fv[0], 10) << "it moves";
  EXPECT_LT(estimator.contacts().d_fv[1], 1) << "it stands";
}

}  // namespace
}  // namespace kilvo
