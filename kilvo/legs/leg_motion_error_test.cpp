// What a robot that is not quite as described does to a way on its legs, against ways that are walked with such a robot.
#include "kilvo/legs/leg_motion_error.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace kilvo {
namespace leg_motion_error_test {

constexpr double mount = 0.01, length = 0.01, gyro_scale = 0.003;  // one standard deviation of each

struct Error {
  Eigen::Vector3d tilt_of_legs = Eigen::Vector3d::Zero();  // rad, in the IMU frame
  double length = 0, gyro_scale = 0, gyro_drift = 0;       // rad/s^2
};

/// A way of `steps` of 1 cm along x of the IMU, turning by `turn` each, at intervals of dt (s).
struct Way {
  State end;
  LegMotionError error;
};
Way way_of(int steps, double turn, const Error& e, double dt = 0) {
  Way way;
  State& x = way.end;
  x.g = {0, 0, -standard_gravity};
  way.error.add(x, {}, 0, 0, true);
  for (int i = 0; i < steps; ++i) {
    x.R = x.R * SO3::Exp({0, 0, (1 + e.gyro_scale) * turn + e.gyro_drift * (i + 0.5) * dt * dt});
    x.p += x.R * (SO3::Exp(e.tilt_of_legs) * Eigen::Vector3d((1 + e.length) * 0.01, 0, 0));
    way.error.add(x, {}, 0, dt, true);
  }
  return way;
}

double squared(const Way& way, const Way& truth) {
  Eigen::Matrix<double, 6, 1> off;
  off << (truth.end.R.inverse() * way.end.R).Log(), way.end.p - truth.end.p;
  PoseCovariance P = way.error.error(way.end);
  P.diagonal().array() += 1e-6;
  return off.dot(P.llt().solve(off));
}

TEST(LegMotionError, AnErrorOfOneStandardDeviationIsOneStandardDeviationOff) {
  for (const double turn : {0.0, 0.002, -0.003}) {
    SCOPED_TRACE(turn);
    const Way truth = way_of(1000, turn, {});
    EXPECT_NEAR(squared(way_of(1000, turn, {{0, mount, 0}, 0, 0}), truth), 1, 0.1);
    EXPECT_NEAR(squared(way_of(1000, turn, {{0, 0, mount}, 0, 0}), truth), 1, 0.1);
    EXPECT_NEAR(squared(way_of(1000, turn, {{0, 0, 0}, length, 0}), truth), 1, 0.1);
    EXPECT_NEAR(squared(way_of(1000, turn, {{0, 0, 0}, 0, gyro_scale}), truth), turn == 0 ? 0 : 1, 0.1);
  }
}

TEST(LegMotionError, AGyroThatWarmsUpTurnsTheWay) {
  constexpr double drift = 2e-5, dt = 0.05;  // of one standard deviation; 50 s
  const Way truth = way_of(1000, 0.002, {}, dt);
  Error warming;
  warming.gyro_drift = drift;
  EXPECT_NEAR(squared(way_of(1000, 0.002, warming, dt), truth), 1, 0.1);
}

// Ten metres in a circle: a leg that is too long makes a larger circle, but a mount that is pitched climbs all the way.
TEST(LegMotionError, AWayBackUndoesWhatItCan) {
  const double round = 2 * std::numbers::pi / 1000;
  const Way there = way_of(500, round, {}), back = way_of(1000, round, {});
  const PoseCovariance half = there.error.error(there.end), whole = back.error.error(back.end);
  EXPECT_LT(whole(3, 3) + whole(4, 4), 0.5 * (half(3, 3) + half(4, 4)));
  EXPECT_NEAR(std::sqrt(whole(5, 5)), 10 * mount, 0.1 * mount);
}

TEST(LegMotionError, BeginsAnewWhereThePoseIsKnown) {
  Way way = way_of(100, 0.01, {});
  way.error.pose_is_measured(Eigen::Matrix3d::Zero());
  way.error.add(way.end, {}, 0, 0, false);
  EXPECT_TRUE(way.error.error(way.end).isZero(0));
}

// A corridor: the sweeps hold all but the position along x.
TEST(LegMotionError, GoesOnAlongWhatNoSweepMeasures) {
  Way way = way_of(1000, 0.002, {});
  const PoseCovariance before = way.error.error(way.end);
  way.error.pose_is_measured(Eigen::Vector3d(1, 0, 0).asDiagonal());
  const PoseCovariance after = way.error.error(way.end);
  EXPECT_GT(before(4, 4), 0.01 * 0.01);
  EXPECT_NEAR(after(4, 4), 0, 1e-12);
  EXPECT_NEAR(after(3, 3), before(3, 3), 1e-9);
}

/// A minute beside a LiDAR at 0.5 m/s, forward and in curves, of an IMU that is mounted at `R`; the legs measure (I + M) v and `noise`.
LegMotionError beside_a_lidar(const SO3& R, const Eigen::Matrix3d& M, double noise) {
  LegMotionError error;
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, noise);
  State x;
  x.g = {0, 0, -standard_gravity};
  x.R = R;
  constexpr double dt = 0.01;
  for (int i = 0; i < 6000; ++i) {
    if (i % 10 == 0) error.pose_is_measured(Eigen::Matrix3d::Zero());
    x.R = SO3::Exp({0, 0, 0.5 * dt * std::sin(1e-3 * i)}) * x.R;
    x.v = x.R * (R.inverse() * Eigen::Vector3d(0.5, 0, 0));
    x.p += dt * x.v;
    const Eigen::Vector3d v = x.R.inverse() * x.v;
    const Eigen::Vector3d measured = v + M * v + Eigen::Vector3d(normal(random), normal(random), normal(random));
    error.add(x, measured - error.matrix() * measured, i % 30 < 25 ? 1 : 0, dt, false);
  }
  return error;
}

TEST(LegMotionError, IsLearntBesideALidarHoweverTheImuIsMounted) {
  for (const Eigen::Vector3d& mounted : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3.14, 0, 0), Eigen::Vector3d(0, 0.4, 0)}) {
    SCOPED_TRACE(mounted.transpose());
    const SO3 R = SO3::Exp(mounted);
    const auto in_imu = [&](const Eigen::Matrix3d& M) { return Eigen::Matrix3d(R.matrix().transpose() * M * R.matrix()); };
    Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
    M(0, 0) = 0.02;   // too long
    M(1, 0) = -0.01;  // turned
    M(2, 0) = 0.03;   // climbing, which is not learnt
    const Eigen::Vector3d forward = R.inverse() * Eigen::Vector3d(1, 0, 0);
    const Eigen::Vector3d learnt = R * (beside_a_lidar(R, in_imu(M), 0.01).matrix() * forward);
    EXPECT_NEAR(learnt.x(), 0.02, 0.002);
    EXPECT_NEAR(learnt.y(), -0.01, 0.002);
    EXPECT_NEAR(learnt.z(), 0, 0.002);
  }
}

TEST(LegMotionError, OfARobotThatIsAsDescribedNothingIsLearnt) {
  EXPECT_LT(beside_a_lidar({}, Eigen::Matrix3d::Zero(), 0.01).matrix().norm(), 0.0005);
}

// What has been learnt makes the legs alone more certain.
TEST(LegMotionError, WhatIsLearntIsNotConsideredAnyMore) {
  LegMotionError known = beside_a_lidar({}, 0.01 * Eigen::Matrix3d::Identity(), 0.01), unknown;
  State x;
  x.g = {0, 0, -standard_gravity};
  for (int i = 0; i < 1000; ++i) {
    x.p.x() += 0.01;
    known.add(x, {}, 0, 0, true);
    unknown.add(x, {}, 0, 0, true);
  }
  EXPECT_LT(known.error(x)(3, 3), 0.35 * unknown.error(x)(3, 3));
  EXPECT_GT(known.error(x)(5, 5), 0.9 * unknown.error(x)(5, 5));  // the vertical
}

}  // namespace leg_motion_error_test
}  // namespace kilvo
