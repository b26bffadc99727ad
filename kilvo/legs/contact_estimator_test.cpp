#include "kilvo/legs/contact_estimator.hpp"

#include <algorithm>
#include <functional>
#include <gtest/gtest.h>
#include <vector>

#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo {
namespace {

using test::Gait;
using test::SoleMotion;

struct Change {
  std::size_t side = 0;
  bool on = false;
  double s = 0;
};

// Where the soles and the body are at a time.
struct Scene {
  std::function<SoleMotion(std::size_t side, double s)> sole;
  std::function<State(double s)> body;
  double velocity_noise = 0;  // m/s, of each corner and axis
};

Scene walk(const Gait& gait) {
  return {[gait](std::size_t side, double s) { return gait.sole(side, s); }, [gait](double s) { return gait.body(s); }};
}

Scene standing() {
  return {[](std::size_t side, double) {
            return SoleMotion{{0, side == 0 ? 0.1 : -0.1, 0}};
          },
          [](double) {
            return test::body_at({0, 0, 0.75}, {0, 0, 0});
          }};
}

// What the estimator reports of a scene, in order of time.
std::vector<Change> watch(ContactEstimator& estimator, const Scene& scene, double from, double to, double rate = 1000) {
  test::Random random(1);
  std::vector<Change> out;
  for (int i = 0; from + i / rate < to; ++i) {
    const double s = from + i / rate;
    const State x = scene.body(s);
    Feet feet;
    feet.t = test::gait_begin + from_seconds(s);
    for (std::size_t side = 0; side < 2; ++side) {
      feet.foot[side] = test::seen_from(x, scene.sole(side, s));
      for (std::size_t k = 0; k < 4; ++k) feet.foot[side].v[k] += random.vector3(scene.velocity_noise);
    }
    const std::array<bool, 2> before = i == 0 ? std::array<bool, 2>{true, true} : estimator.contacts().on;
    const Contacts& now = estimator.update(feet, x, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, standard_gravity));
    EXPECT_EQ(now.t, feet.t);
    for (std::size_t side = 0; side < 2; ++side) {
      if (now.on[side] != before[side]) out.push_back({side, now.on[side], s});
    }
  }
  return out;
}

std::vector<Change> watch(const Scene& scene, double to, double rate = 1000) {
  ContactEstimator estimator{LegConfig{}};
  return watch(estimator, scene, 0, to, rate);
}

std::vector<Change> truth_of(const Gait& gait, double from, double to) {
  std::vector<Change> out;
  const auto add = [&](std::size_t side, bool on, double s) {
    if (s >= from && s < to) out.push_back({side, on, s});
  };
  for (std::size_t side = 0; side < 2; ++side) {
    for (double s = gait.first + 0.5 * gait.cycle() * static_cast<double>(side); s < to; s += gait.cycle()) {
      add(side, false, s);
      add(side, true, s + gait.swing);
    }
  }
  return out;
}

// Each true change from `from` to `to` is reported once, at most so much early or late, and nothing else is.
void expect_changes(const Gait& gait, const std::vector<Change>& reported, double from, double to, double early, double late) {
  const auto between = [&](const Change& c) { return c.s >= from - early && c.s < to + late; };
  const std::vector<Change> truth = truth_of(gait, from, to);
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count_if(reported, between)), truth.size());
  EXPECT_GT(truth.size(), 4u);
  for (const Change& t : truth) {
    const auto matches = [&](const Change& r) { return r.side == t.side && r.on == t.on && r.s >= t.s - early && r.s <= t.s + late; };
    EXPECT_EQ(std::ranges::count_if(reported, matches), 1)
        << (t.side == 0 ? "left" : "right") << (t.on ? " touchdown" : " lift-off") << " at " << t.s;
  }
}

TEST(ContactEstimator, FindsEachLiftOffAndTouchdownWithin15MillisecondsAtAnySpeedOfAnyRobot) {
  for (const double leg : {0.4, 0.75, 1.2}) {
    for (const double scale : {0.5, 1.0, 1.7, 3.0}) {
      SCOPED_TRACE(testing::Message() << "leg " << leg << " m, scale " << scale);
      Gait gait;
      gait.leg = leg;
      gait.step *= scale;
      gait.lift *= scale;
      expect_changes(gait, watch(walk(gait), 9), 4.2, 8.45, 0.015, 0.015);
    }
  }
}

TEST(ContactEstimator, NoStepIsMissedOrSeenTwiceFromTheFirstOneOn) {
  for (const double scale : {0.5, 1.0, 3.0}) {
    SCOPED_TRACE(scale);
    Gait gait;
    gait.step *= scale;
    gait.lift *= scale;
    expect_changes(gait, watch(walk(gait), 6), 0.5, 5.5, 0.06, 0.06);
  }
}

TEST(ContactEstimator, AtLowerRatesChangesAreFoundThreeSamplesAfterTheyCanBeSeen) {
  for (const double rate : {200.0, 100.0}) {
    SCOPED_TRACE(rate);
    const Gait gait;
    // A foot that leaves is faster than a tenth of its swing after 11 ms.
    expect_changes(gait, watch(walk(gait), 9, rate), 4.2, 8.45, 0.015, 0.011 + 3 / rate);
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
    expect_changes(gait, watch(walk(gait), 10), 4.2, 9.45, 0.02, 0.035);
  }
}

TEST(ContactEstimator, StandingWithNoisyVelocitiesNeverLifts) {
  Scene scene = standing();
  scene.velocity_noise = 0.02;
  EXPECT_TRUE(watch(scene, 20).empty());
}

TEST(ContactEstimator, OneOrTwoWildSamplesAreNoLiftOff) {
  for (const double rate : {1000.0, 100.0}) {
    for (const int wild : {1, 2, 4}) {
      SCOPED_TRACE(testing::Message() << wild << " samples at " << rate << " Hz");
      Scene scene = standing();
      scene.sole = [=](std::size_t side, double s) {
        const double samples = (s - 2) * rate;
        const bool off = samples > -0.5 && samples < wild - 0.5;
        return SoleMotion{{0, side == 0 ? 0.1 : -0.1, 0}, {off ? 3.0 : 0.0, 0, 0}};
      };
      EXPECT_EQ(watch(scene, 2.1, rate).empty(), wild <= 2);
    }
  }
}

TEST(ContactEstimator, AFootThatSlidesSlowlyStaysOn) {
  ContactEstimator estimator{LegConfig{}};
  const Gait gait;
  watch(estimator, walk(gait), 0, 6.5);
  const double slide = 0.05 * estimator.swing_speed();
  Scene scene = standing();
  scene.sole = [=](std::size_t side, double s) {
    SoleMotion out{{0, side == 0 ? 0.1 : -0.1, 0}};
    if (side == 1) return out;
    out.p.x() = slide * (s - 7.2);
    out.v.x() = slide;
    return out;
  };
  watch(estimator, standing(), 6.5, 7.2);
  EXPECT_TRUE(watch(estimator, scene, 7.2, 9).empty());
}

TEST(ContactEstimator, SoftGroundThatThrowsAFootUpByFiveMillimetresIsNoLiftOff) {
  const Gait gait;
  Scene scene = walk(gait);
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
  expect_changes(gait, watch(scene, 9), 4.2, 8.45, 0.015, 0.015);
}

TEST(ContactEstimator, AWalkThatBecomesARunIsFollowed) {
  const Gait slow;
  Gait fast;
  fast.step = 1.2;
  fast.lift = 0.12;
  fast.stance = 0.25;
  fast.first = 0;
  ContactEstimator estimator{LegConfig{}};
  watch(estimator, walk(slow), 0, 5.5);
  const double walking = estimator.swing_speed();
  watch(estimator, standing(), 5.5, 6.0);
  // The run begins 6 s later than its own clock.
  Scene later = walk(fast);
  later.sole = [fast](std::size_t side, double s) { return fast.sole(side, s - 6); };
  later.body = [fast](double s) { return fast.body(s - 6); };
  std::vector<Change> run = watch(estimator, later, 6.0, 12.0);
  for (Change& c : run) c.s -= 6;
  expect_changes(fast, run, 0.5, 5.5, 0.02, 0.02);
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
  watch(estimator, walk(fast), 0, 6.02);
  ASSERT_GT(estimator.swing_speed(), 5);
  watch(estimator, standing(), 6.02, 7.0);
  Scene later = walk(slow);
  later.sole = [slow](std::size_t side, double s) { return slow.sole(side, s - 7); };
  later.body = [slow](double s) { return slow.body(s - 7); };
  std::vector<Change> walked = watch(estimator, later, 7.0, 17.0);
  for (Change& c : walked) c.s -= 7;
  expect_changes(slow, walked, 6.5, 9.5, 0.015, 0.015);
}

TEST(ContactEstimator, OneWildSampleInASwingDoesNotMakeTheRobotFast) {
  const Gait gait;
  ContactEstimator estimator{LegConfig{}};
  Scene scene = walk(gait);
  scene.sole = [gait](std::size_t side, double s) {
    SoleMotion out = gait.sole(side, s);
    if (side == 0 && std::abs(s - 3.7) < 4e-4) out.v.x() += 40;
    return out;
  };
  ASSERT_FALSE(gait.stands(0, 3.7));
  const std::vector<Change> all = watch(estimator, scene, 0, 9);
  expect_changes(gait, all, 4.2, 8.45, 0.015, 0.015);
  EXPECT_LT(estimator.swing_speed(), 3);
}

TEST(ContactEstimator, ARobotThatIsAlreadyWalkingIsUnderstoodAfterItsFirstSteps) {
  const Gait gait;
  ContactEstimator estimator{LegConfig{}};
  const std::vector<Change> all = watch(estimator, walk(gait), 3.1, 9);
  ASSERT_FALSE(all.empty());
  EXPECT_FALSE(all.front().on) << "the foot in the air is noticed";
  EXPECT_LT(all.front().s, 3.11 + gait.cycle() / 2);
  expect_changes(gait, all, 5.9, 8.45, 0.015, 0.015);
}

// Without force nobody can tell a foot that hangs still from one that stands still: it is reported as standing, which is true of its
// velocity, and leaves again as soon as it moves.
TEST(ContactEstimator, OfALiftedRobotTheFeetLeaveAndStandWhileTheyHangStill) {
  Scene scene = standing();
  const auto up = [](double s) { return 0.2 * (1 - std::cos(std::numbers::pi * std::clamp(s - 1, 0.0, 1.0))); };  // 0.4 m in 1 s
  const auto rate = [](double s) { return s > 1 && s < 2 ? 0.2 * std::numbers::pi * std::sin(std::numbers::pi * (s - 1)) : 0.0; };
  scene.sole = [=](std::size_t side, double s) { return SoleMotion{{0, side == 0 ? 0.1 : -0.1, up(s)}, {0, 0, rate(s)}}; };
  scene.body = [=](double s) { return test::body_at({0, 0, 0.75 + up(s)}, {0, 0, rate(s)}); };
  ContactEstimator estimator{LegConfig{}};
  const std::vector<Change> all = watch(estimator, scene, 0, 4);
  ASSERT_EQ(all.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(all[i].on, i >= 2);
  EXPECT_LT(all[1].s, 1.1);
  EXPECT_GT(all[2].s, 2.15) << "not before they have hung still for 0.2 s";
  EXPECT_LT(all[3].s, 2.25);
}

TEST(ContactEstimator, ARestartForgetsTheFeetButNotTheRobot) {
  ContactEstimator estimator{LegConfig{}};
  const Gait gait;
  watch(estimator, walk(gait), 0, 6.25);
  ASSERT_FALSE(estimator.contacts().on[0] && estimator.contacts().on[1]);
  const double speed = estimator.swing_speed();
  estimator.restart();
  EXPECT_TRUE(watch(estimator, standing(), 7, 8).empty()) << "both stand until they move";
  EXPECT_TRUE(estimator.contacts().on[0] && estimator.contacts().on[1]);
  EXPECT_EQ(estimator.swing_speed(), speed);
  EXPECT_GT(estimator.phase(0, estimator.contacts().t), 1.0);
}

TEST(ContactEstimator, ClearanceIsTheHeightOverTheLastPlaceOfTheFoot) {
  const Gait gait;
  const double apex = gait.first + gait.cycle() * 3 + gait.swing * 2 / 3;
  ContactEstimator estimator{LegConfig{}};
  watch(estimator, walk(gait), 0, apex);
  EXPECT_NEAR(estimator.contacts().clearance[0], gait.lift, 0.003);
  EXPECT_NEAR(estimator.contacts().clearance[1], 0, 1e-9);
  EXPECT_GT(estimator.contacts().d_fv[0], 10) << "it moves";
  EXPECT_LT(estimator.contacts().d_fv[1], 1) << "it stands";
}

}  // namespace
}  // namespace kilvo
