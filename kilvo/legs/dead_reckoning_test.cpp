// What a robot that is not quite as described does to a way on its legs, against ways that are walked with such a robot.
#include "kilvo/legs/dead_reckoning.hpp"

#include <gtest/gtest.h>
#include <numbers>

namespace kilvo {
namespace {

constexpr double mount = 0.01, length = 0.01, gyro_scale = 0.003;  // one standard deviation of each

struct Error {
  Eigen::Vector3d tilt_of_legs = Eigen::Vector3d::Zero();  // rad, in the IMU frame
  double length = 0, gyro_scale = 0;
};

/// A way of `steps` of 1 cm along x of the IMU, turning by `turn` each.
struct Way {
  State end;
  DeadReckoning reckoning;
};
Way walked(int steps, double turn, const Error& e) {
  Way way;
  State& x = way.end;
  x.g = {0, 0, -standard_gravity};
  way.reckoning.add(x);
  for (int i = 0; i < steps; ++i) {
    x.R = x.R * SO3::Exp({0, 0, (1 + e.gyro_scale) * turn});
    x.p += x.R * (SO3::Exp(e.tilt_of_legs) * Eigen::Vector3d((1 + e.length) * 0.01, 0, 0));
    way.reckoning.add(x);
  }
  return way;
}

double squared(const Way& way, const Way& truth) {
  Eigen::Matrix<double, 6, 1> off;
  off << (truth.end.R.inverse() * way.end.R).Log(), way.end.p - truth.end.p;
  PoseCovariance P = way.reckoning.error(way.end);
  P.diagonal().array() += 1e-6;
  return off.dot(P.llt().solve(off));
}

TEST(DeadReckoning, AnErrorOfOneStandardDeviationIsOneStandardDeviationOff) {
  for (const double turn : {0.0, 0.002, -0.003}) {
    SCOPED_TRACE(turn);
    const Way truth = walked(1000, turn, {});
    EXPECT_NEAR(squared(walked(1000, turn, {{0, mount, 0}, 0, 0}), truth), 1, 0.1);
    EXPECT_NEAR(squared(walked(1000, turn, {{0, 0, mount}, 0, 0}), truth), 1, 0.1);
    EXPECT_NEAR(squared(walked(1000, turn, {{0, 0, 0}, length, 0}), truth), 1, 0.1);
    EXPECT_NEAR(squared(walked(1000, turn, {{0, 0, 0}, 0, gyro_scale}), truth), turn == 0 ? 0 : 1, 0.1);
  }
}

// Ten metres in a circle: a leg that is too long makes a larger circle, but a mount that is pitched climbs all the way.
TEST(DeadReckoning, AWayBackUndoesWhatItCan) {
  const double round = 2 * std::numbers::pi / 1000;
  const Way there = walked(500, round, {}), back = walked(1000, round, {});
  const PoseCovariance half = there.reckoning.error(there.end), whole = back.reckoning.error(back.end);
  EXPECT_LT(whole(3, 3) + whole(4, 4), 0.5 * (half(3, 3) + half(4, 4)));
  EXPECT_NEAR(std::sqrt(whole(5, 5)), 10 * mount, 0.1 * mount);
}

TEST(DeadReckoning, BeginsAnewWhereThePoseIsKnown) {
  Way way = walked(100, 0.01, {});
  way.reckoning.restart();
  way.reckoning.add(way.end);
  EXPECT_TRUE(way.reckoning.error(way.end).isZero(0));
}

}  // namespace
}  // namespace kilvo
