#include "kilvo/lidar/mount_error.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace mount_error_test {

constexpr double degree = M_PI / 180;

SO3 seen_with_noise(const SO3& R, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 0.005 * degree);
  const Eigen::Vector3d wrong(noise(random), noise(random), noise(random));
  return R * SO3::Exp(wrong);
}

/// Two minutes of swaying and turning, as a torso does that walks, seen by a gyro that measures M w, and by sweeps every 0.1 s.
MountError after_walking_with(const Eigen::Matrix3d& M, std::uint32_t seed) {
  std::mt19937 random(seed);
  MountError out;
  Trajectory by_gyro(std::chrono::milliseconds(500));
  SO3 R, R_gyro;
  constexpr double dt = 0.005;
  for (int i = 0; i < 24'000; ++i) {
    const double t = i * dt;
    const Eigen::Vector3d w(0.2 * std::cos(6 * t), 0.25 * std::cos(12 * t + 1), 0.2 * std::sin(6 * t) + 0.5 * std::sin(0.4 * t));
    const Time now{from_seconds(t)};
    by_gyro.push(now, {R_gyro, {}}, {});
    if (i % 20 == 0) out.add(now, seen_with_noise(R, random), by_gyro);
    R = R * SO3::Exp(w * dt);
    R_gyro = R_gyro * SO3::Exp(M * w * dt);
  }
  return out;
}

TEST(MountError, IsHardlyAnyWhereSweepsAndGyroAgree) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    EXPECT_LT(after_walking_with(Eigen::Matrix3d::Identity(), seed).sigma(), 0.02 * degree) << seed;
  }
}

TEST(MountError, IsTheAngleByWhichTheLidarIsTurnedOnTheImu) {
  for (const double angle : {0.1, 0.5, 1.0}) {
    const Eigen::Matrix3d turned = SO3::Exp(angle * degree * Eigen::Vector3d(1, 1, 1)).matrix();
    const double found = after_walking_with(turned, 1).sigma() / degree;
    // Six of the nine elements are as large as the angle.
    EXPECT_GT(found, 0.7 * angle);
    EXPECT_LT(found, 1.5 * angle);
  }
}

TEST(MountError, IsNotKnownBeforeTheRobotHasMoved) {
  std::mt19937 random(1);
  MountError error;
  Trajectory still(std::chrono::milliseconds(500));
  for (int i = 0; i < 400; ++i) {
    const Time t{from_seconds(0.05 * i)};
    still.push(t, {}, {});
    error.add(t, seen_with_noise({}, random), still);
  }
  EXPECT_GT(error.sigma(), 0.3 * degree);
  EXPECT_TRUE(error.at({}).isZero(0)) << "and a pose that has not changed is right all the same";
}

// The error of poses that are computed with a wrong mount is what the covariance says: here of one rotation and one shift at a time.
TEST(MountError, CoversWhatAWrongMountDoesToAPose) {
  const MountError error = after_walking_with(SO3::Exp(0.5 * degree * Eigen::Vector3d(1, 1, 1)).matrix(), 2);
  const double sigma = error.sigma();
  const SE3 T(SO3::Exp({0.1, -0.2, 2.5}), {3, -4, 0.5});
  const PoseCovariance D = error.at(T);
  PoseCovariance sum = PoseCovariance::Zero();
  for (int axis = 0; axis < 6; ++axis) {
    Eigen::Matrix<double, 6, 1> wrong = Eigen::Matrix<double, 6, 1>::Zero();
    wrong(axis) = 1e-6;
    const SE3 E(SO3::Exp(wrong.head<3>()), wrong.tail<3>());
    // All poses are seen turned and shifted in their own frame, in a world that makes the first the right one.
    const SE3 seen = E.inverse() * T * E;
    Eigen::Matrix<double, 6, 1> d;
    d << (T.R.inverse() * seen.R).Log(), seen.p - T.p;
    sum += d * d.transpose() * 1e12;
  }
  EXPECT_LT((D - sigma * sigma * sum).norm(), 1e-4 * D.norm());
}

}  // namespace mount_error_test
}  // namespace kilvo
