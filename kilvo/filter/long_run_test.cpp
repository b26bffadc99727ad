// What a robot does all day: predict, predict, predict, update. Nothing may creep.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "kilvo/filter/predict.hpp"
#include "kilvo/filter/update.hpp"
#include "tests/helpers/predict.hpp"
#include "tests/helpers/random_state.hpp"

namespace kilvo {
namespace long_run_test {

#ifdef NDEBUG
constexpr int total_steps = 1'000'000;
#else
constexpr int total_steps = 20'000;
#endif

Rows<6> pose_rows(const State& x, const SE3& measured, double sigma) {
  Rows<6> rows;
  rows.r.resize(6);
  rows.r << (measured.R.inverse() * x.R).Log(), x.p - measured.p;
  rows.H.setZero(6, at::size);
  rows.H.block<3, 3>(0, at::R) = right_jacobian(rows.r.head<3>()).inverse();
  rows.H.block<3, 3>(3, at::p).setIdentity();
  rows.R = Eigen::Matrix<double, 6, 6>::Identity() * sigma * sigma;
  return rows;
}

Rows<6> height_row(const State& x, double sigma) {
  Rows<6> rows;
  rows.r.resize(1);
  rows.r << x.p.z();
  rows.H.setZero(1, at::size);
  rows.H(0, at::p + 2) = 1;
  rows.R.setConstant(1, 1, sigma * sigma);
  return rows;
}

TEST(LongRun, TheCovarianceStaysSymmetricPositiveDefiniteOverAMillionMixedSteps) {
  test::Random random(1);
  Estimate e;
  e.P.diagonal().setConstant(1e-10);
  e.P.diagonal().segment<3>(at::g).setConstant(2.5e-3);
  e.P.diagonal().segment<3>(at::ba).setConstant(2.5e-3);
  const UpdateConfig config;
  int updates = 0;
  for (int i = 0; i < total_steps; ++i) {
    if (i % 10 == 9) {
      ++updates;
      // Sharp and vague, all six and a single one.
      const double sigma = i % 20 == 9 ? 1e-4 : 0.1;
      const SE3 measured{SO3::Exp(random.vector3(sigma)), random.vector3(sigma)};
      e = update(
              e, [&](const State& x, const Covariance&) { return i % 30 == 9 ? height_row(x, sigma) : pose_rows(x, measured, sigma); },
              config)
              .posterior;
    } else {
      const Time end = e.t + Duration(i % 7 == 0 ? 1'000'000 : 5'000'000);
      const ImuSample s{e.t, random.vector3(0.5), Eigen::Vector3d(0, 0, standard_gravity) + random.vector3(1)};
      const StandingFeet feet = {i % 200 < 100, false};
      e = test::predict(e, ImuInterval::hold(s, e.t, end), feet, {});
    }
    if (i % 1000 == 999 || i % 1000 == 998) {
      ASSERT_EQ(e.P, e.P.transpose()) << i;
      ASSERT_EQ(e.P.llt().info(), Eigen::Success) << i;
      ASSERT_TRUE(is_finite(e)) << i;
    }
  }
  EXPECT_EQ(updates, total_steps / 10);
  EXPECT_LT(e.x.p.norm(), 0.5);
  EXPECT_NEAR(e.x.g.norm(), standard_gravity, 1e-9);
  EXPECT_LT((e.x.R.matrix().transpose() * e.x.R.matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

}  // namespace long_run_test
}  // namespace kilvo
