#include "kilvo/estimator/levelling.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace {

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

TEST(Levelling, TurnsTheWorldOnceGravityIsKnown) {
  Levelling levelling;
  for (double s = 0; s < 3.9; s += 0.1) levelling.add(walking(s));
  EXPECT_FALSE(levelling.turn());
  for (double s = 4; s < 5; s += 0.1) levelling.add(walking(s));
  ASSERT_TRUE(levelling.turn());
  EXPECT_NEAR(levelling.tilt(), 0.5 * M_PI / 180, 1e-9);
  Output o = walking(5);
  const double trace = o.P.trace();
  Levelling::apply(*levelling.turn(), o);
  EXPECT_NEAR(o.x.p.z(), 0, 1e-9);
  EXPECT_NEAR(o.x.v.z(), 0, 1e-9);
  EXPECT_NEAR((o.x.g - Eigen::Vector3d(0, 0, -9.80665)).norm(), 0, 1e-9);
  EXPECT_NEAR(o.P.trace(), trace, 1e-9);
  EXPECT_NEAR(o.points_W[0].head<3>().norm(), std::sqrt(14), 1e-5);
}

TEST(Levelling, LeavesAWorldAloneWhoseGravityNobodyLearnt) {
  Levelling levelling;
  for (double s = 0; s < 3; s += 0.1) levelling.add(walking(s));
  levelling.finish();
  ASSERT_TRUE(levelling.turn());
  EXPECT_EQ(levelling.tilt(), 0);
}

}  // namespace
}  // namespace kilvo
