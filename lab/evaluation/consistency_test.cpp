#include "lab/evaluation/consistency.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <stdexcept>

namespace kilvo::lab {
namespace consistency_test {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A covariance with correlations between everything: about 0.02 rad and 0.05 m.
Matrix6 some_covariance() {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const Matrix6 a = Matrix6::NullaryExpr([&] { return normal(random); });
  Vector6 scale;
  scale << 0.01, 0.01, 0.01, 0.02, 0.02, 0.02;
  return scale.asDiagonal() * (a * a.transpose() + Matrix6::Identity()) * scale.asDiagonal();
}

/// Mean and variance of the NEES of truths drawn from N(estimate, P) when the estimate claims P_claimed.
std::pair<double, double> drawn(const Matrix6& P, const Matrix6& P_claimed) {
  std::mt19937 random(12);
  std::normal_distribution<double> normal;
  const Matrix6 L = P.llt().matrixL();
  const SE3 estimate{SO3::Exp({0.5, -1, 2}), {3, 4, 5}};
  constexpr int count = 5000;
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const Vector6 e = L * Vector6::NullaryExpr([&] { return normal(random); });
    const double x = nees(estimate, {estimate.R * SO3::Exp(e.head<3>()), estimate.p + e.tail<3>()}, P_claimed);
    sum += x;
    squares += x * x;
  }
  return {sum / count, squares / count - sum / count * sum / count};
}

TEST(Nees, OfAConsistentEstimateIsChiSquareWithSixDegrees) {
  const auto [mean, variance] = drawn(some_covariance(), some_covariance());
  EXPECT_NEAR(mean, 6, 4 * std::sqrt(12.0 / 5000));
  EXPECT_NEAR(variance, 12, 1.0);
}

TEST(Nees, OfAnOverconfidentEstimateIsTooLarge) {
  const auto [mean, variance] = drawn(some_covariance(), 0.25 * some_covariance());
  EXPECT_NEAR(mean, 24, 0.8);
  EXPECT_GT(variance, 150);
}

TEST(Nees, IsTheSquareOfTheErrorInSigmas) {
  Matrix6 P = Matrix6::Zero();
  P.diagonal() << 0.01, 0.02, 0.03, 0.1, 0.2, 0.3;
  P.diagonal() = P.diagonal().cwiseAbs2().eval();
  const SE3 estimate{SO3::Exp({0, 0, 1}), {1, 2, 3}};
  EXPECT_NEAR(nees(estimate, estimate, P), 0, 1e-20);
  EXPECT_NEAR(nees(estimate, {estimate.R * SO3::Exp({0.02, 0, 0}), {1, 2, 3}}, P), 4, 1e-9);
  EXPECT_NEAR(nees(estimate, {estimate.R, {1, 2, 3.9}}, P), 9, 1e-9);
}

TEST(Nees, RefusesACovarianceThatIsNone) {
  Matrix6 P = Matrix6::Identity();
  P(2, 2) = 0;
  EXPECT_THROW(nees({}, {}, P), std::invalid_argument);
  P(2, 2) = -1;
  EXPECT_THROW(nees({}, {}, P), std::invalid_argument);
  P = Matrix6::Identity();
  P(0, 1) = 0.5;
  EXPECT_THROW(nees({}, {}, P), std::invalid_argument);
}

}  // namespace consistency_test
}  // namespace kilvo::lab
