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

TEST(GapInflation, OfTwoPartsIsThatOfTheWhole) {
  Estimate whole = standing(), parts = standing();
  inflate_covariance_over_gap(whole, at_seconds(0), at_seconds(0.6), 0.6);
  inflate_covariance_over_gap(parts, at_seconds(0), at_seconds(0.2), 0.6);
  inflate_covariance_over_gap(parts, at_seconds(0.2), at_seconds(0.6), 0.6);
  EXPECT_LT((whole.P - parts.P).norm(), 1e-12);
}

TEST(GapInflation, TurnsMoreAboutTheVerticalThanItLeans) {
  Estimate e = standing();
  e.x.R = SO3::Exp(Eigen::Vector3d(M_PI, 0, 0));  // hung upside down: up is -z of the IMU
  inflate_covariance_over_gap(e, at_seconds(0), at_seconds(1), 1);
  EXPECT_GT(e.P(at::R + 2, at::R + 2), 10 * e.P(at::R, at::R));
}

}  // namespace gap_test
}  // namespace kilvo
