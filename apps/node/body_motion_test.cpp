#include "apps/node/body_motion.hpp"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>
#include <random>

namespace kilvo::node {
namespace body_motion_test {

using Vector6 = Eigen::Matrix<double, 6, 1>;

struct Numbers {
  std::mt19937 engine{7};
  std::normal_distribution<double> normal;
  Eigen::Vector3d vector(double size) { return size * Eigen::Vector3d(normal(engine), normal(engine), normal(engine)); }
};

Output some_output(Numbers& numbers) {
  Output o;
  o.x.R = SO3::Exp(numbers.vector(1));
  o.x.p = numbers.vector(3);
  o.x.v = numbers.vector(1);
  o.omega = numbers.vector(1);
  Covariance A;
  for (int i = 0; i < A.size(); ++i) A.data()[i] = 0.01 * numbers.normal(numbers.engine);
  o.P = A * A.transpose();
  return o;
}

// How pose and twist of the base change with an error of the state, by ROS's convention.
Vector6 pose_change(const Output& o, const ErrorVector& d, const SE3& T_IB) {
  const SE3 a = o.x.pose() * T_IB, b = boxplus(o.x, d).pose() * T_IB;
  Vector6 out;
  out << b.p - a.p, (b.R * a.R.inverse()).Log();
  return out;
}
Vector6 twist_change(const Output& o, const ErrorVector& d, const SE3& T_IB) {
  Output moved = o;
  moved.x = boxplus(o.x, d);
  moved.omega -= d.segment<3>(at::bg);
  const BodyMotion a = body_motion(o, {T_IB}, 0), b = body_motion(moved, {T_IB}, 0);
  Vector6 out;
  out << b.v_B - a.v_B, b.omega_B - a.omega_B;
  return out;
}

TEST(BodyMotion, CovariancesAreThoseOfCentralDifferences) {
  Numbers numbers;
  for (int trial = 0; trial < 50; ++trial) {
    const Output o = some_output(numbers);
    const SE3 T_IB{SO3::Exp(numbers.vector(1)), numbers.vector(0.3)};
    Eigen::Matrix<double, 6, at::size> pose, twist;
    constexpr double step = 1e-6;
    for (int i = 0; i < at::size; ++i) {
      const ErrorVector d = step * ErrorVector::Unit(i);
      pose.col(i) = (pose_change(o, d, T_IB) - pose_change(o, -d, T_IB)) / (2 * step);
      twist.col(i) = (twist_change(o, d, T_IB) - twist_change(o, -d, T_IB)) / (2 * step);
    }
    const BodyMotion motion = body_motion(o, {T_IB}, 0);
    const Matrix6 C_pose = pose * o.P * pose.transpose(), C_twist = twist * o.P * twist.transpose();
    EXPECT_LT((motion.pose_covariance - C_pose).norm(), 1e-6 * C_pose.norm());
    EXPECT_LT((motion.twist_covariance - C_twist).norm(), 1e-6 * C_twist.norm());
    EXPECT_EQ(motion.pose_covariance, motion.pose_covariance.transpose());
    EXPECT_EQ(motion.twist_covariance, motion.twist_covariance.transpose());
    EXPECT_EQ(Eigen::LLT<Matrix6>(motion.pose_covariance).info(), Eigen::Success);
    EXPECT_EQ(Eigen::LLT<Matrix6>(motion.twist_covariance).info(), Eigen::Success);
  }
}

TEST(BodyMotion, ABaseBesideTheImuMovesWithTheTurn) {
  Output o;
  o.omega = {0, 0, 2};
  o.x.v = {1, 0, 0};
  const BodyMotion motion = body_motion(o, {{SO3(), {0, 0.5, 0}}}, 1e-4);
  EXPECT_NEAR((motion.v_B - Eigen::Vector3d(0, 0, 0)).norm(), 0, 1e-12) << "the turn takes the base back as fast as the IMU goes on";
  EXPECT_NEAR(motion.twist_covariance(5, 5), 1e-4, 1e-12);
  EXPECT_NEAR(motion.twist_covariance(0, 0), 0.25e-4, 1e-12);
}

TEST(BodyMotion, ABaseThatMovesAgainstTheImuHasTheRatesOfItsPoses) {
  Numbers numbers;
  Output o = some_output(numbers);
  const SE3 T_IB{SO3::Exp(numbers.vector(1)), numbers.vector(0.3)};
  const Eigen::Vector3d v = numbers.vector(0.5), omega = numbers.vector(0.5);  // of the base against the IMU
  constexpr double h = 1e-6;
  const auto pose_after = [&](double dt) {
    const SE3 T_WI{o.x.R * SO3::Exp(dt * o.omega), o.x.p + dt * o.x.v};
    return T_WI * SE3{SO3::Exp(dt * omega) * T_IB.R, T_IB.p + dt * v};
  };
  const SE3 before = pose_after(-h), now = pose_after(0), after = pose_after(h);
  const BodyMotion motion = body_motion(o, {T_IB, v, omega}, 0);
  EXPECT_LT((now.R * motion.v_B - (after.p - before.p) / (2 * h)).norm(), 1e-6);
  EXPECT_LT((motion.omega_B - (before.R.inverse() * after.R).Log() / (2 * h)).norm(), 1e-6);
}

TEST(BodyMotion, SeenFromAnotherWorldOnlyTheAxesOfThePoseChange) {
  Numbers numbers;
  const Output o = some_output(numbers);
  const SE3 T_OW{SO3::Exp(Eigen::Vector3d(0, 0, 0.3)), numbers.vector(1)}, T_IB{SO3::Exp(numbers.vector(1)), numbers.vector(0.3)};
  const BodyMotion here = body_motion(o, {T_IB}, 0), there = seen_from(here, o, T_OW * o.x.pose(), T_IB);
  EXPECT_LT((there.pose.p - T_OW * here.pose.p).norm(), 1e-12);
  EXPECT_EQ(there.v_B, here.v_B);
  EXPECT_EQ(there.twist_covariance, here.twist_covariance);
  const Eigen::Matrix3d turned = T_OW.R.matrix() * here.pose_covariance.topLeftCorner<3, 3>() * T_OW.R.matrix().transpose();
  EXPECT_LT((there.pose_covariance.topLeftCorner<3, 3>() - turned).norm(), 1e-12);
}

}  // namespace body_motion_test
}  // namespace kilvo::node
