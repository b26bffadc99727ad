// The filter by itself, on cues drawn from distributions that it does not know.
#include "kilvo/legs/contact_filter.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numeric>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace contact_filter_test {

// A walk as its cues say it: 0.6 s of stance, 0.4 s of swing for each foot.
struct Walk {
  double stance_speed = 0.01, swing_speed = 0.2, spread = 0.5;  // medians, and sigma of their logarithms
  double lift = 0.04, height_noise = 0.004;
  double side_noise = 0.2;

  static constexpr double cycle = 1.0, swing = 0.4;
  static bool stands(std::size_t side, double s) {
    const double within = std::fmod(s + (side == 0 ? 0.0 : 0.5 * cycle), cycle);
    return s < 0 || within >= swing;
  }
  ContactCues cues(test::Random& random, double s, double dt) const {
    ContactCues out;
    out.dt = dt;
    const bool left = stands(0, s), right = stands(1, s);
    for (std::size_t side = 0; side < 2; ++side)
      out.speed[side] = (stands(side, s) ? stance_speed : swing_speed) * std::exp(random.normal(spread));
    out.height = (left ? 0 : lift) - (right ? 0 : lift) + random.normal(height_noise);
    out.force_side = (left && right ? 0.5 : left ? 1.0 : 0.0) + random.normal(side_noise);
    return out;
  }
};

// Share of right flags from the third second on.
double accuracy(const Walk& walk, double rate) {
  test::Random random(3);
  ContactFilter filter;
  double right = 0, all = 0;
  for (double s = -1; s < 12; s += 1 / rate) {
    filter.update(walk.cues(random, s, 1 / rate));
    for (std::size_t side = 0; side < 2 && s > 3; ++side) {
      right += (filter.carries(side) > 0.5) == Walk::stands(side, s) ? 1 : 0;
      ++all;
    }
  }
  return right / all;
}

TEST(ContactFilter, FollowsWalksAtAnyRateWithoutACliff) {
  double last = 1;
  for (const double rate : {2000.0, 1000.0, 500.0, 200.0, 100.0, 50.0}) {
    const double now = accuracy(Walk{}, rate);
    EXPECT_GT(now, rate > 60 ? 0.95 : 0.92) << rate << " Hz";
    EXPECT_GT(now, last - 0.03) << rate << " Hz";
    last = now;
  }
}

// Share of wrong flags from the fifth second after `blips` on; the noise of the cues lasts for 20 ms. Each cycle lasts 1 s, longer or
// shorter by at most `irregular`; before `blips` each swing has a moment in which the foot seems to stand.
double errors_of_gait(double irregular, double blips = 0) {
  const Walk walk;
  test::Random random(7);
  ContactFilter filter;
  double wrong = 0, all = 0, phase = -1, pace = 1;
  std::uint64_t noise = 0;
  for (double s = -1; s < 60; s += 0.002) {
    if (std::fmod(s + 1, 0.02) < 0.002) ++noise;
    const double cycles = std::floor(phase);
    phase += 0.002 * pace;
    if (std::floor(phase) > cycles) pace = 1 / random.uniform(1 - irregular, 1 + irregular);
    test::Random held(noise);
    const double within = std::fmod(phase + 1, 0.5 * Walk::cycle);
    const bool blip = s < blips && within > 0.18 && within < 0.22;
    filter.update(walk.cues(held, blip ? -1 : phase, 0.002));
    for (std::size_t side = 0; side < 2 && s > blips + 5; ++side) {
      wrong += (filter.carries(side) > 0.5) == Walk::stands(side, phase) ? 0 : 1;
      ++all;
    }
  }
  return wrong / all;
}

// The cues are as good in both.
TEST(ContactFilter, AGaitThatKeepsItsTimesIsFollowedBetterThanOneThatDoesNot) {
  const double regular = errors_of_gait(0), irregular = errors_of_gait(0.7);
  EXPECT_LT(regular, 0.5 * irregular);
  EXPECT_LT(regular, 0.001);
  EXPECT_LT(irregular, 0.003);
}

TEST(ContactFilter, FeetThatAreDownForAMomentDoNotShortenTheirSwings) { EXPECT_LT(errors_of_gait(0, 30), errors_of_gait(0) + 0.0005); }

TEST(ContactFilter, LearnsRobotsWhoseSolesNeverSeemToStandStill) {
  for (const double stance : {0.002, 0.01, 0.04}) {
    Walk walk;
    walk.stance_speed = stance;
    walk.swing_speed = 8 * stance + 0.1;
    EXPECT_GT(accuracy(walk, 200), 0.95) << stance;
  }
}

TEST(ContactFilter, TheShareOfTheLoadIsCountedFromWhereTheForceGoesOnThisRobot) {
  ContactFilter fresh;
  EXPECT_NEAR(fresh.share_of_left(0.5), 0.5, 1e-12);
  EXPECT_EQ(fresh.share_of_left(-1), 0);
  EXPECT_EQ(fresh.share_of_left(2), 1);
  // A robot that leans: on its left foot the line of force passes at 1.3, on its right one at 0.3.
  Walk walk;
  walk.side_noise = 0.05;
  test::Random random(5);
  ContactFilter filter;
  for (double s = -1; s < 12; s += 0.005) {
    ContactCues cues = walk.cues(random, s, 0.005);
    cues.force_side += 0.3;
    filter.update(cues);
  }
  EXPECT_NEAR(filter.share_of_left(0.8), 0.5, 0.05);
  EXPECT_GT(filter.share_of_left(1.25), 0.9);
  EXPECT_LT(filter.share_of_left(0.35), 0.1);
}

TEST(ContactFilter, OneWildSampleDecidesNothing) {
  for (const double dt : {0.0005, 0.001, 0.002}) {
    ContactFilter filter;
    ContactCues cues;
    cues.dt = dt;
    cues.speed = {0.005, 0.005};
    for (int i = 0; i < 400; ++i) filter.update(cues);
    cues.speed = {3, 0.005};
    filter.update(cues);
    EXPECT_GT(filter.carries(0), 0.5) << dt;
  }
}

TEST(ContactFilter, SpeedsSeenWithAnUnknownVelocitySayNothing) {
  ContactFilter filter;
  ContactCues cues;
  cues.dt = 0.001;
  cues.speed = {0.9, 0.8};
  cues.known_velocity = 0;
  for (int i = 0; i < 2000; ++i) filter.update(cues);
  EXPECT_GT(filter.carries(0), 0.8);
  EXPECT_GT(filter.carries(1), 0.8);
}

// With a velocity that is wrong all feet seem to move; nothing weighs less than half of the body's weight on the ground.
TEST(ContactFilter, OneFootCarriesAtLeastUnlessTheBodyFalls) {
  ContactFilter filter;
  ContactCues cues;
  cues.dt = 0.001;
  cues.speed = {0.9, 0.8};
  for (int i = 0; i < 2000; ++i) {
    filter.update(cues);
    ASSERT_GT(filter.carries(0) + filter.carries(1), 0.99);
  }
  cues.load = 0.02;
  cues.height = 0;
  for (int i = 0; i < 100; ++i) filter.update(cues);
  EXPECT_GT(filter.probabilities()[ContactFilter::none], 0.5);
}

TEST(ContactFilter, ProbabilitiesAddUpToOneWhateverTheCuesAre) {
  test::Random random(5);
  ContactFilter filter;
  for (int i = 0; i < 5000; ++i) {
    ContactCues cues;
    cues.dt = std::abs(random.normal(0.02));
    cues.speed = {std::abs(random.normal(10)), std::abs(random.normal(0.001))};
    cues.height = random.normal(1);
    cues.force_side = random.normal(5);
    cues.load = std::abs(random.normal(2));
    cues.impact = {random.normal(1) > 0, random.normal(1) > 0};
    filter.update(cues);
    const auto& p = filter.probabilities();
    ASSERT_NEAR(std::accumulate(p.begin(), p.end(), 0.0), 1, 1e-12);
    for (const double one : p) ASSERT_TRUE(one > 0 && one <= 1);
  }
}

// How late the left foot's touchdowns are found once the robot is known, s.
double lateness(bool with_impacts) {
  test::Random random(3);
  Walk walk;
  walk.spread = 1;
  walk.height_noise = 0.02;
  ContactFilter filter;
  double late = 0, touchdowns = 0, came = 0;
  bool stood = true, found = true;
  for (double s = -1; s < 30; s += 0.001) {
    ContactCues cues = walk.cues(random, s, 0.001);
    const bool stands = Walk::stands(0, s);
    if (stands && !stood) {
      came = s;
      found = false;
    }
    cues.impact[0] = with_impacts && stands && s - came < 0.004;
    filter.update(cues);
    if (!found && filter.carries(0) > 0.5) {
      found = true;
      if (s > 8) {
        late += s - came;
        ++touchdowns;
      }
    }
    stood = stands;
  }
  EXPECT_GE(touchdowns, 20);
  return late / touchdowns;
}

TEST(ContactFilter, ImpactsThatComeWithTouchdownsBringThemForward) { EXPECT_LT(lateness(true), 0.8 * lateness(false)); }

}  // namespace contact_filter_test
}  // namespace kilvo
