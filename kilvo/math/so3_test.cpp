#include "kilvo/math/so3.hpp"

#include <Eigen/LU>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <vector>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace so3_test {

constexpr double pi = std::numbers::pi;

// Around every place where a series, a branch or a sign takes over.
std::vector<double> delicate_angles() {
  return {1e-12, 1e-7, 1e-4, 1e-3 - 1e-9, 1e-3, 1e-3 + 1e-9, 2e-3 - 1e-9, 2e-3 + 1e-9, 0.1, 1.0, 2.0, pi / 2, pi - 1e-3, pi - 1e-9};
}

Eigen::Matrix3d numeric_right_jacobian(const Eigen::Vector3d& theta) {
  constexpr double h = 1e-5;
  Eigen::Matrix3d J;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(i);
    const SO3 back = SO3::Exp(theta).inverse();
    J.col(i) = ((back * SO3::Exp(theta + d)).Log() - (back * SO3::Exp(theta - d)).Log()) / (2 * h);
  }
  return J;
}

TEST(SO3, ExpIsTheRotationAboutItsAxis) {
  test::Random random(1);
  for (const double angle : delicate_angles()) {
    const Eigen::Vector3d axis = random.direction();
    const Eigen::Matrix3d expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    EXPECT_LT((SO3::Exp(angle * axis).matrix() - expected).norm(), 1e-15 + 1e-12 * std::min(angle, 1e-3)) << angle;
  }
  EXPECT_EQ(SO3::Exp(Eigen::Vector3d::Zero()).matrix(), Eigen::Matrix3d::Identity());
}

TEST(SO3, LogUndoesExpNearZeroNearPiAndAnywhere) {
  test::Random random(2);
  std::vector<double> angles = delicate_angles();
  for (int i = 0; i < 200; ++i) angles.push_back(random.uniform(0, pi));
  for (const double angle : angles) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d theta = angle * random.direction();
      EXPECT_LT((SO3::Exp(theta).Log() - theta).norm(), 2e-12 * angle) << angle;
    }
  }
  EXPECT_EQ(SO3().Log(), Eigen::Vector3d::Zero());
}

TEST(SO3, AtPiLogIsOneOfTheTwoRotationVectors) {
  test::Random random(3);
  std::vector<Eigen::Vector3d> axes = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
  for (int i = 0; i < 50; ++i) axes.push_back(random.direction());
  for (const Eigen::Vector3d& axis : axes) {
    const SO3 R = SO3::Exp(pi * axis);
    const Eigen::Vector3d log = R.Log();
    EXPECT_NEAR(log.norm(), pi, 1e-12);
    EXPECT_LT(log.cross(axis).norm(), 1e-12);
    EXPECT_LT((SO3::Exp(log).matrix() - R.matrix()).norm(), 1e-14);
  }
}

TEST(SO3, LogIsNeverLongerThanPi) {
  test::Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const double angle = i % 2 == 0 ? random.uniform(0, 20) : pi + random.normal(1e-9);
    const SO3 R = SO3::Exp(angle * random.direction());
    EXPECT_LE(R.Log().norm(), pi * (1 + 1e-15));
    EXPECT_LT((SO3::Exp(R.Log()).matrix() - R.matrix()).norm(), 1e-14);
  }
}

TEST(SO3, RightJacobianIsTheDerivativeOfExp) {
  test::Random random(5);
  std::vector<double> angles = delicate_angles();
  angles.insert(angles.end(), {0.0, pi, 4.0});
  for (const double angle : angles) {
    for (int i = 0; i < 10; ++i) {
      const Eigen::Vector3d theta = angle * random.direction();
      EXPECT_LT((right_jacobian(theta) - numeric_right_jacobian(theta)).norm(), 1e-8) << angle;
    }
  }
}

TEST(SO3, JacobiansDoNotJumpWhereTheSeriesTakesOver) {
  test::Random random(7);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d axis = random.direction();
    const Eigen::Vector3d below = 0.9999999e-3 * axis, above = 1.0000001e-3 * axis;
    EXPECT_LT((right_jacobian(below) - right_jacobian(above)).norm(), 3e-10);
  }
}

TEST(SO3, AMillionProductsStayOrthonormal) {
  test::Random random(8);
  SO3 R = random.rotation();
  const SO3 a = random.rotation(), b = random.rotation();
  for (int i = 0; i < 500000; ++i) R = (R * a) * b;
  EXPECT_LT((R.matrix().transpose() * R.matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(R.matrix().determinant(), 1, 1e-12);
}

TEST(SO3, NearestRemovesStretchAndNeverReflects) {
  test::Random random(9);
  for (int i = 0; i < 50; ++i) {
    const SO3 R = random.rotation();
    EXPECT_LT((SO3::nearest(1.01 * R.matrix()).matrix() - R.matrix()).norm(), 1e-14);
    const Eigen::Matrix3d bent = R.matrix() * (Eigen::Matrix3d::Identity() + 1e-6 * Eigen::Vector3d(1, -2, 3).asDiagonal().toDenseMatrix());
    EXPECT_LT((SO3::nearest(bent).matrix() - R.matrix()).norm(), 1e-11);
    EXPECT_NEAR(SO3::nearest(R.matrix() * Eigen::Vector3d(1, 1, -1e-3).asDiagonal()).matrix().determinant(), 1, 1e-12);
  }
}

TEST(SO3, QuaternionAndMatrixAreTheSameRotation) {
  test::Random random(10);
  for (int i = 0; i < 50; ++i) {
    const SO3 R = random.rotation();
    EXPECT_LT((SO3::from_quaternion(R.quaternion()).matrix() - R.matrix()).norm(), 1e-14);
    EXPECT_LT((SO3::from_quaternion(Eigen::Quaterniond(3.0 * R.quaternion().coeffs())).matrix() - R.matrix()).norm(), 1e-14);
    const Eigen::Vector3d v = random.vector3();
    EXPECT_LT((R.quaternion() * v - R * v).norm(), 1e-14);
  }
}

}  // namespace so3_test
}  // namespace kilvo
