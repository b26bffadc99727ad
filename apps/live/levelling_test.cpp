#include "apps/live/levelling.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace levelling_test {

// A world whose z axis is 0.5 degrees off, in which gravity becomes known after 4 s.
Output walking(double s) {
  Output o;
  const SO3 tilted = SO3::Exp(Eigen::Vector3d(0.5 * M_PI / 180, 0, 0));
  o.t = Time(from_seconds(s));
  o.x.g = tilted * Eigen::Vector3d(0, 0, -9.80665);
  o.x.p = tilted * Eigen::Vector3d(s, 2 * s, 0);
  o.x.v = tilted * Eigen::Vector3d(1, 2, 0);
  o.x.R = tilted;
  o.points_W = {PointXYZI(1, 2, 3, 4)};
  const double sigma = s < 4 ? 0.05 : 0.004;
  o.P.diagonal().segment<3>(at::g).setConstant(sigma * sigma);
  o.P.diagonal().segment<3>(at::p) << 1, 4, 9;
  return o;
}

std::vector<Event> events_of(Levelling& levelling, double from, double until) {
  std::vector<Event> out;
  for (double s = from; s < until; s += 0.1) {
    Output o = walking(s);
    levelling.add(o);
    out.insert(out.end(), o.events.begin(), o.events.end());
  }
  return out;
}

TEST(Levelling, TurnsTheWorldOnceGravityIsKnown) {
  Levelling levelling;
  EXPECT_TRUE(events_of(levelling, 0, 3.9).empty());
  EXPECT_FALSE(levelling.turn());
  const std::vector<Event> events = events_of(levelling, 4, 5);
  ASSERT_TRUE(levelling.turn());
  ASSERT_EQ(events.size(), 1u) << "once";
  EXPECT_EQ(text_of(events.front()), "the world was rotated by 0.50 degrees, so that its z axis is up");
  EXPECT_EQ(events.front().t, walking(4).t);
  EXPECT_FALSE(levelling.finish()) << "reported already";
  Output o = walking(5);
  const double trace = o.P.trace();
  Levelling::apply(*levelling.turn(), o);
  EXPECT_NEAR(o.x.p.z(), 0, 1e-9);
  EXPECT_NEAR(o.x.v.z(), 0, 1e-9);
  EXPECT_NEAR((o.x.g - Eigen::Vector3d(0, 0, -9.80665)).norm(), 0, 1e-9);
  EXPECT_NEAR(o.P.trace(), trace, 1e-9);
  EXPECT_NEAR(o.points_W[0].head<3>().norm(), std::sqrt(14), 1e-5);
}

TEST(Levelling, WaitsAsLongAsItMay) {
  // One of two directions is known better than at the start.
  const auto half_known = [](double s) {
    Output o = walking(0);
    o.t = walking(s).t;
    if (s > 1) o.P(at::g, at::g) = 1e-4;
    return o;
  };
  Levelling patient(Duration::max()), usual;
  for (double s = 0; s < 25; s += 0.5) {
    Output a = half_known(s), b = half_known(s);
    patient.add(a);
    usual.add(b);
    EXPECT_EQ(usual.turn().has_value(), s > 20) << s;
    EXPECT_EQ(b.events.size(), s == 20.5 ? 1u : 0u) << s;
  }
  EXPECT_FALSE(patient.turn());
}

// The accelerometer at rest knew the vertical to 5 mrad: 20 mrad contradict it, and stand only where they are known.
TEST(Levelling, DoesNotFollowAGravityThatContradictsTheStartAndIsNotKnown) {
  for (const double sigma : {0.02, 0.004}) {
    Levelling levelling;
    for (double s = 0; s < 22; s += 0.5) {
      Output o = walking(0);
      o.t = walking(s).t;
      o.x.g = SO3::Exp(Eigen::Vector3d(0.02, 0, 0)) * Eigen::Vector3d(0, 0, -9.80665);
      if (s > 10) o.P.diagonal().segment<2>(at::g).setConstant(sigma * sigma);
      levelling.add(o);
    }
    ASSERT_TRUE(levelling.turn());
    EXPECT_NEAR(levelling.turn()->Log().norm(), sigma > 0.01 ? 0 : 0.02, 1e-9);
  }
}

// On the move it began with a guess, of 40 mrad.
TEST(Levelling, FollowsAGravityThatContradictsAGuess) {
  Levelling levelling;
  for (double s = 0; s < 22; s += 0.5) {
    Output o = walking(0);
    o.t = walking(s).t;
    o.x.g = SO3::Exp(Eigen::Vector3d(0.15, 0, 0)) * Eigen::Vector3d(0, 0, -9.80665);
    const double sigma = s > 10 ? 0.16 : 0.4;
    o.P.diagonal().segment<2>(at::g).setConstant(sigma * sigma);
    levelling.add(o);
  }
  ASSERT_TRUE(levelling.turn());
  EXPECT_NEAR(levelling.turn()->Log().norm(), 0.15, 1e-9);
}

TEST(Levelling, FollowsTheLegsWhereTheyHaveSettledTheVertical) {
  Levelling levelling(Duration::max());
  EXPECT_TRUE(events_of(levelling, 0, 3).empty());
  Output o = walking(3);
  o.vertical_W = SO3::Exp(Eigen::Vector3d(0.3 * M_PI / 180, 0, 0)) * Eigen::Vector3d::UnitZ();
  levelling.add(o);
  ASSERT_TRUE(levelling.turn());
  EXPECT_NEAR(levelling.turn()->Log().norm(), 0.3 * M_PI / 180, 1e-9) << "not as gravity seems to be";
  EXPECT_EQ(o.events.size(), 1u);
}

TEST(Levelling, TurnsTheGroundUnderTheFeetWithTheWorld) {
  Output o = walking(5);
  const SO3 tilted = o.x.R, level = tilted.inverse();
  o.contacts.emplace();
  o.contacts->normal = tilted * Eigen::Vector3d::UnitZ();
  for (GroundPatch& patch : o.contacts->ground) patch = {tilted * Eigen::Vector3d::UnitZ(), tilted * Eigen::Vector3d(5, 10, 0), 0.01};
  Levelling::apply(level, o);
  EXPECT_NEAR(o.contacts->normal.z(), 1, 1e-12);
  for (const GroundPatch& patch : o.contacts->ground) {
    EXPECT_NEAR(patch.normal.z(), 1, 1e-12);
    EXPECT_NEAR((patch.point - Eigen::Vector3d(5, 10, 0)).norm(), 0, 1e-12);
  }
}

TEST(Levelling, SaysWhichWorldAnOutputIsIn) {
  Output o = walking(5);
  const Output before = o;
  EXPECT_FALSE(o.R_LW);
  const SO3 level = o.x.R.inverse();
  Levelling::apply(level, o);
  ASSERT_TRUE(o.R_LW);
  Levelling::apply(o.R_LW->inverse(), o);
  EXPECT_NEAR((o.x.p - before.x.p).norm(), 0, 1e-12);
  EXPECT_NEAR((o.points_W[0] - before.points_W[0]).norm(), 0, 1e-5);
}

TEST(Levelling, LeavesAWorldAloneWhoseGravityNobodyLearnt) {
  Levelling levelling;
  EXPECT_TRUE(events_of(levelling, 0, 3).empty());
  EXPECT_FALSE(levelling.finish());
  ASSERT_TRUE(levelling.turn());
  EXPECT_EQ(levelling.turn()->Log().norm(), 0);
}

}  // namespace levelling_test
}  // namespace kilvo
