#include "kilvo/filter/gap.hpp"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace kilvo {
namespace gap_test {

Time at_seconds(double s) { return Time(from_seconds(s)); }

Estimate standing() {
  Estimate e;
  e.x.g = {0, 0, -9.80665};
  e.P.diagonal().setConstant(1e-6);
  return e;
}

TEST(GapInflation, LeavesACovarianceThatGrowsWithTheGap) {
  double before = 0;
  for (const double gap : {0.1, 0.3, 1.0, 3.0}) {
    Estimate e = standing();
    inflate_covariance_over_gap(e, at_seconds(0), at_seconds(gap), gap);
    EXPECT_GT(e.P(at::p, at::p), before);
    before = e.P(at::p, at::p);
    EXPECT_GT(e.P.ldlt().vectorD().minCoeff(), 0) << gap;
    EXPECT_EQ(e.P, e.P.transpose()) << gap;
    // A robot that walks, not one that is shot: 0.3 m/s and what it does to the position.
    EXPECT_LT(std::sqrt(e.P(at::p, at::p)), 0.4 * gap + 0.1 * gap * gap) << gap;
  }
}

Estimate walking() {
  Estimate e = standing();
  e.x.v = {1, 0.2, 0};
  e.P(at::v, at::v) = 0.01;
  e.P(at::p, at::v) = e.P(at::v, at::p) = 1e-5;
  return e;
}

void cross(Estimate& e, double begin, double end, double gap) {
  carry_blind(e, at_seconds(end), {0, 0, 0.3}, {});
  inflate_covariance_over_gap(e, at_seconds(begin), at_seconds(end), gap);
}

TEST(GapInflation, OfTwoPartsIsThatOfTheWhole) {
  Estimate whole = walking(), parts = walking();
  cross(whole, 0, 0.6, 0.6);
  cross(parts, 0, 0.2, 0.6);
  cross(parts, 0.2, 0.6, 0.6);
  EXPECT_LT((whole.x.p - parts.x.p).norm() + (whole.x.v - parts.x.v).norm(), 1e-12);
  EXPECT_LT((whole.P - parts.P).norm(), 1e-12);
}

// After a minute a robot that walked is about where it stopped to be seen, and the covariance says within metres.
TEST(GapInflation, ALongGapForgetsTheVelocity) {
  Estimate e = walking();
  cross(e, 0, 60, 60);
  EXPECT_NEAR(e.x.p.x(), 2, 1e-6);
  EXPECT_LT(e.x.v.norm(), 1e-9);
  EXPECT_NEAR(std::sqrt(e.P(at::p, at::p)), 0.5 * 2 * std::sqrt(57.0), 0.1);
  EXPECT_NEAR(std::sqrt(e.P(at::v, at::v)), 0.5, 1e-3);
  EXPECT_EQ(e.P, e.P.transpose());
}

TEST(GapInflation, HasNoNegativeVarianceHoweverShortItsParts) {
  for (const double dt : {1e-9, 1e-6, 1e-3, 0.0199, 0.0201}) {
    Estimate e = standing();
    e.P.setZero();
    inflate_covariance_over_gap(e, at_seconds(0), at_seconds(dt), 1);
    EXPECT_GE(e.P(at::p, at::p), 0) << dt;
    EXPECT_GE(e.P(at::p, at::p) * e.P(at::v, at::v) * (1 + 1e-9), e.P(at::p, at::v) * e.P(at::p, at::v)) << dt;
  }
}

TEST(GapInflation, TurnsMoreAboutTheVerticalThanItLeans) {
  Estimate e = standing();
  e.x.R = SO3::Exp(Eigen::Vector3d(M_PI, 0, 0));  // hung upside down: up is -z of the IMU
  inflate_covariance_over_gap(e, at_seconds(0), at_seconds(1), 1);
  EXPECT_GT(e.P(at::R + 2, at::R + 2), 10 * e.P(at::R, at::R));
}

}  // namespace gap_test
}  // namespace kilvo
