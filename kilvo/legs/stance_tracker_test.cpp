// When feet enter and leave the filter, and how much they count. What that does to a state: kilvo/estimator/stances_test.cpp.
#include "kilvo/legs/stance_tracker.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <optional>

#include "tests/helpers/random.hpp"
#include "tests/helpers/surface_groups.hpp"
#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo {
namespace stance_tracker_test {

const ImuSample level_imu = {Time{}, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, standard_gravity)};

test::SoleMotion standing(std::size_t side) { return {{0, side == 0 ? 0.1 : -0.1, 0}}; }

TEST(StanceTracker, AFootEntersAfterItsDelayLooselyAndLeavesWithItsContact) {
  test::Gait gait;
  LegConfig config;
  ContactEstimator contacts;
  StanceTracker tracker(config);
  std::array<bool, 2> inside = {false, false};
  int entered = 0, left = 0, loose = 0;
  for (int i = 0; i < 6000; ++i) {
    const double s = 1e-3 * i;
    const Feet feet = gait.feet(s);
    contacts.update(feet, gait.body(s), Eigen::Vector3d::Zero(), level_imu.accel);
    const LegStep step = tracker.step(feet, contacts.contacts(), gait.body(s), Eigen::Vector3d::Zero());
    EXPECT_TRUE(i == 0 || std::abs(step.dt - 1e-3) < 1e-12);
    for (std::size_t side = 0; side < 2; ++side) {
      const Stance& foot = step.foot[side];
      EXPECT_EQ(foot.begins, foot.used && !inside[side]);
      EXPECT_EQ(foot.ends, !foot.used && inside[side]);
      if (foot.begins && i > 100) {
        EXPECT_GT(foot.variance_scale, 9);
        EXPECT_NEAR(contacts.contacts().phase(side), config.entry_delay, 0.0011);
        ++entered;
      }
      left += foot.ends ? 1 : 0;
      const bool settled = foot.used && contacts.contacts().phase(side) > 0.1 && gait.stands(side, s);
      const auto& load = contacts.contacts().load;
      const double lighter = step.foot[1 - side].used ? std::max(1.0, load[1 - side] / std::max(0.01, load[side])) : 1.0;
      loose += settled && foot.variance_scale > 1.1 * lighter ? 1 : 0;
      inside[side] = foot.used;
    }
  }
  EXPECT_GE(entered, 10);
  EXPECT_GE(left, entered);
  EXPECT_LT(loose, 20) << "of 12000: some in doubt as the other foot comes down";
}

TEST(StanceTracker, AFootThatIsBeyondItsGateForLongEntersAnewWhereItIs) {
  LegConfig config;
  ContactEstimator contacts;
  StanceTracker tracker(config);
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  int ended = 0, began_again = 0;
  for (int i = 0; i < 400; ++i) {
    Feet feet;
    feet.t = test::gait_begin + from_seconds(1e-3 * i);
    feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
    contacts.update(feet, body, Eigen::Vector3d::Zero(), level_imu.accel);
    const LegStep step = tracker.step(feet, contacts.contacts(), body, Eigen::Vector3d::Zero());
    const bool off = i >= 100 && i < 125;
    tracker.judge(step, {!off, true});
    EXPECT_TRUE(step.foot[0].used && step.foot[1].used) << "a foot carries";
    EXPECT_EQ(step.foot[0].ends, i > 0 && step.foot[0].begins);
    ended += step.foot[0].ends ? 1 : 0;
    began_again += i > 0 && step.foot[0].begins ? 1 : 0;
  }
  EXPECT_EQ(ended, 1);
  EXPECT_EQ(began_again, 1);
}

TEST(StanceTracker, WhenNoFootIsBelievedTheMoreProbableCarriesUnlessTheBodyFalls) {
  StanceTracker tracker{LegConfig{}};
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  Feet feet;
  feet.t = test::gait_begin;
  feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
  Contacts contacts;
  contacts.t = feet.t;
  contacts.on = {false, false};
  contacts.probability = {0.2, 0.4};
  const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
  EXPECT_FALSE(step.foot[0].used);
  ASSERT_TRUE(step.foot[1].used);
  EXPECT_GE(step.foot[1].variance_scale, 2) << "believed as far as it is probable";
  contacts.flight = true;
  feet.t += std::chrono::milliseconds(1);
  const LegStep flying = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
  EXPECT_FALSE(flying.foot[0].used || flying.foot[1].used);
}

// A touchdown jolts the robot: for a sample or two the foot that carries seems to leave. Were it to enter anew, its place would be lost.
TEST(StanceTracker, AFootInContactKeepsItsPlaceThroughTheImpactOfTheOther) {
  const auto after_impact = [](double probability) {
    StanceTracker tracker{LegConfig{}};
    const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
    Feet feet;
    feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
    Contacts contacts;
    contacts.since = {test::gait_begin - std::chrono::seconds(1), test::gait_begin};
    std::array<LegStep, 2> out;
    for (int i = 0; i < 40; ++i) {
      feet.t = contacts.t = test::gait_begin + std::chrono::milliseconds(10 * i);
      const bool left_jolts = i == 30, right_is_down = i >= 30;
      contacts.on = {!left_jolts, right_is_down};
      contacts.probability = {left_jolts ? probability : 0.99, right_is_down ? 0.99 : 0.01};
      if (i == 30) contacts.since = {feet.t, feet.t};
      if (i == 31) contacts.since[0] = feet.t;
      const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
      if (i == 30 || i == 31) out[static_cast<std::size_t>(i - 30)] = step;
    }
    return out;
  };
  const auto kept = after_impact(0.45);
  EXPECT_TRUE(kept[0].foot[0].used);
  EXPECT_FALSE(kept[0].foot[1].used);
  EXPECT_FALSE(kept[1].foot[0].begins);
  EXPECT_LT(kept[1].foot[0].variance_scale, 3) << "it does not settle again";
  const auto left = after_impact(0.05);
  EXPECT_FALSE(left[0].foot[0].used);
  EXPECT_TRUE(left[0].foot[1].used);
  EXPECT_FALSE(left[1].foot[0].used);
}

TEST(StanceTracker, AFootThatStillSlidesAsItEntersTakesItsContactPositionAlongAndALaterOneDoesNot) {
  constexpr double sliding = 0.2, period = 1e-3;  // m/s, s
  const LegConfig config;
  StanceTracker tracker{config};
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  double entering = 0, later = 0;
  for (int i = 0; i < 100; ++i) {
    Feet feet;
    feet.t = test::gait_begin + from_seconds(period * i);
    feet.foot = {test::seen_from(body, {{sliding * period * i, 0.1, 0}, {sliding, 0, 0}}), test::seen_from(body, standing(1))};
    Contacts contacts;
    contacts.t = feet.t;
    contacts.since = {test::gait_begin, test::gait_begin - std::chrono::seconds(1)};
    const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
    (contacts.phase(0) < config.entry_delay + 0.02 ? entering : later) += step.foot[0].slide_variance;
    EXPECT_EQ(step.foot[1].slide_variance, 0);
  }
  EXPECT_NEAR(std::sqrt(entering), sliding * 0.02, 0.1 * sliding * 0.02) << "as far as it slides at this speed while it enters";
  EXPECT_EQ(later, 0) << "or a wrong velocity of the state would take it along";
}

// What contacts learn of supporting soles is of their lowest points, from touchdown to lift-off.
TEST(StanceTracker, AFootThatMovesMoreThanStandingSolesDidCountsLessWhateverContactsLearntOfSoles) {
  StanceTracker tracker{LegConfig{}};
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  Feet feet;
  feet.t = test::gait_begin;
  Contacts contacts;
  contacts.sole_speed = 0.3;
  const auto scale = [&](double speed) {
    feet.t += std::chrono::milliseconds(10);
    feet.foot = {test::seen_from(body, {{0, 0.1, 0}, {speed, 0, 0}}), test::seen_from(body, standing(1))};
    contacts.t = feet.t;
    return tracker.step(feet, contacts, body, Eigen::Vector3d::Zero()).foot[0].variance_scale;
  };
  for (int i = 0; i < 2000; ++i) scale(0);
  EXPECT_EQ(scale(0), 1);
  EXPECT_GT(scale(0.2), 10);
}

// What the encoders' noise makes of one sample is no motion of the sole, at any rate: a foot that moves for long is.
TEST(StanceTracker, NoiseOfSingleSamplesIsNoMotionOfTheSole) {
  constexpr double noise = 0.02;  // m/s, each axis
  StanceTracker tracker{LegConfig{}};
  test::Random random(5);
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  Feet feet;
  feet.t = test::gait_begin;
  Contacts contacts;
  contacts.since.fill(feet.t - std::chrono::seconds(1));
  const auto mean_scale = [&](const Eigen::Vector3d& motion) {
    double sum = 0;
    for (int i = 0; i < 1000; ++i) {
      feet.t += std::chrono::milliseconds(1);
      feet.foot = {test::seen_from(body, {{0, 0.1, 0}, motion + random.vector3(noise)}), test::seen_from(body, standing(1))};
      contacts.t = feet.t;
      sum += tracker.step(feet, contacts, body, Eigen::Vector3d::Zero()).foot[0].variance_scale;
    }
    return sum / 1000;
  };
  for (int i = 0; i < 20; ++i) mean_scale(Eigen::Vector3d::Zero());
  EXPECT_LT(mean_scale(Eigen::Vector3d::Zero()), 3) << "three axes of it alone are 48 variances of the noise of a still sole";
  EXPECT_GT(mean_scale({0.06, 0, 0}), 10);
}

TEST(StanceTracker, OfTwoFeetThatStandTheLighterOneCountsByItsLoadAndOneAloneInFull) {
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  const auto scales = [&body](double left, bool right_stands) {
    StanceTracker tracker{LegConfig{}};
    Feet feet;
    feet.t = test::gait_begin;
    feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
    Contacts contacts;
    contacts.t = feet.t;
    contacts.since.fill(feet.t - std::chrono::seconds(1));
    contacts.on[1] = right_stands;
    contacts.load = {left, 1 - left};
    const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
    return std::array{step.foot[0].variance_scale, step.foot[1].variance_scale};
  };
  EXPECT_NEAR(scales(0.5, true)[0], 1, 1e-9);
  EXPECT_NEAR(scales(0.5, true)[1], 1, 1e-9);
  EXPECT_NEAR(scales(0.2, true)[0], 4, 1e-9);
  EXPECT_NEAR(scales(0.2, true)[1], 1, 1e-9);
  EXPECT_NEAR(scales(0.0, true)[0], 100, 1e-9) << "bounded";
  EXPECT_NEAR(scales(0.2, false)[0], 1, 1e-9) << "it carries all";
}

TEST(StanceTracker, AtALowRateAFootDoesNotWaitForASampleMoreThanItsDelay) {
  for (const double rate : {50.0, 100.0, 1000.0}) {
    LegConfig config;
    StanceTracker tracker(config);
    const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
    Feet feet;
    feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
    Contacts contacts;
    contacts.since.fill(test::gait_begin - std::chrono::seconds(1));
    std::optional<double> entered;
    for (int i = -5; !entered && i < 100; ++i) {
      contacts.t = feet.t = test::gait_begin + from_seconds(i / rate);
      contacts.on[1] = i >= 0;
      if (i == 0) contacts.since[1] = feet.t;
      const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
      if (step.foot[1].used) entered = i / rate;
    }
    ASSERT_TRUE(entered);
    // It came down between the sample that shows it and the one before.
    EXPECT_LE(*entered, config.entry_delay + 1e-9) << rate << " Hz";
    EXPECT_GE(*entered + 1 / rate, config.entry_delay - 1e-9) << rate << " Hz";
  }
}

TEST(StanceTracker, AFootWhoseEncodersAreFrozenWhileTheBodyTurnsIsNotUsed) {
  for (const double rate : {0.0, 0.5}) {
    LegConfig config;
    ContactEstimator contacts;
    StanceTracker tracker(config);
    const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
    LegStep step;
    for (int i = 0; i < 300; ++i) {
      Feet feet;
      feet.t = test::gait_begin + from_seconds(1e-3 * i);
      feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
      feet.foot[1].p[0].x() += 1e-9 * i;
      contacts.update(feet, body, Eigen::Vector3d::Zero(), level_imu.accel);
      step = tracker.step(feet, contacts.contacts(), body, Eigen::Vector3d(0, 0, rate));
    }
    EXPECT_EQ(step.foot[0].used, rate == 0) << "a robot at rest may repeat itself";
    EXPECT_TRUE(step.foot[1].used);
  }
}

TEST(StanceTracker, TheGroundCountsOnceAtEachTouchdownAndOnlyWhereThereIsAMap) {
  const MapConfig map_config;
  VoxelMap map(map_config);
  const auto floor = test::groups_of(test::points_on({-1, -1, 0}, {5, 0, 0}, {0, 2, 0}, 0.04), map_config.voxel_size / 4, 1e-5);
  for (int i = 0; i < 3; ++i) map.insert(floor, 0);
  test::Gait gait;
  for (const VoxelMap* ground : {static_cast<const VoxelMap*>(nullptr), static_cast<const VoxelMap*>(&map)}) {
    LegConfig config;
    ContactEstimator contacts;
    StanceTracker tracker(config);
    int entered = 0, with_ground = 0;
    for (int i = 0; i < 4000; ++i) {
      const double s = 1e-3 * i;
      const Feet feet = gait.feet(s);
      contacts.update(feet, gait.body(s), Eigen::Vector3d::Zero(), level_imu.accel);
      const LegStep step =
          tracker.step(feet, contacts.contacts(), gait.body(s), Eigen::Vector3d::Zero(), 0, {ground, StanceTracker::Ground::use, false});
      for (const Stance& foot : step.foot) {
        entered += foot.begins ? 1 : 0;
        with_ground += foot.ground ? 1 : 0;
        EXPECT_TRUE(!foot.ground || (foot.begins && std::abs(foot.ground->height_of({2, 0, 0})) < 0.005));
      }
    }
    EXPECT_GT(entered, 5);
    EXPECT_EQ(with_ground, ground == nullptr ? 0 : entered);
  }
}

}  // namespace stance_tracker_test
}  // namespace kilvo
