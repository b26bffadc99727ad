#include "kilvo/legs/leg_measurements.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/helpers/random_state.hpp"

namespace kilvo {
namespace leg_measurements_test {

SolePoint random_point(test::Random& random) { return {random.vector3(0.7), random.vector3(1)}; }

// A covariance without contact positions, and the two feet's rows empty.
Estimate random_estimate(test::Random& random, double sigma) {
  Estimate e;
  e.x = test::random_state(random);
  e.P = random.covariance<at::size>(sigma);
  for (std::size_t side = 0; side < 2; ++side) end_stance(e, side);
  return e;
}

// With which a point at `p` must move relative to the body to be at rest in the world.
Eigen::Vector3d resting(const State& x, const Eigen::Vector3d& p, const Eigen::Vector3d& gyro) {
  return x.R.inverse() * -x.v - (gyro - x.bg).cross(p);
}

// Of `residual` over the whole error state, by central differences.
template <class F>
Eigen::Matrix<double, 3, at::size> numeric_jacobian(const State& x, F residual) {
  constexpr double h = 1e-6;
  Eigen::Matrix<double, 3, at::size> J;
  for (int i = 0; i < at::size; ++i) {
    const ErrorVector d = h * ErrorVector::Unit(i);
    J.col(i) = (residual(boxplus(x, d)) - residual(boxplus(x, -d))) / (2 * h);
  }
  return J;
}

Estimate sure_of_itself() {
  Estimate e;
  e.P.diagonal().setConstant(1e-6);
  return e;
}

LegStep both_stand() {
  LegStep step;
  step.dt = 0.001;
  step.velocity_sigma = LegConfig{}.velocity_sigma;
  step.vertical_velocity_sigma = LegConfig{}.vertical_velocity_sigma;
  for (Stance& foot : step.foot) foot.used = true;
  return step;
}

TEST(LegMeasurements, TheVelocityRowIsTheDerivativeOfItsResidual) {
  test::Random random(1);
  for (int i = 0; i < 30; ++i) {
    const State x = test::random_state(random);
    const SolePoint point = random_point(random);
    const Eigen::Vector3d gyro = random.vector3(2);
    const FootVelocityRow row = foot_velocity(x, point, gyro);
    Eigen::Matrix<double, 3, at::size> J = Eigen::Matrix<double, 3, at::size>::Zero();
    J.middleCols<3>(at::R) = row.J_R;
    J.middleCols<3>(at::v) = row.J_v;
    J.middleCols<3>(at::bg) = row.J_bg;
    EXPECT_LT((J - numeric_jacobian(x, [&](const State& y) { return foot_velocity(y, point, gyro).r; })).norm(), 1e-7);
  }
}

TEST(LegMeasurements, ThePositionRowIsTheDerivativeOfItsResidual) {
  test::Random random(2);
  for (int i = 0; i < 30; ++i) {
    const State x = test::random_state(random);
    const SolePoint point = random_point(random);
    const FootPositionRow row = foot_position(x, point, x.pc[1]);
    Eigen::Matrix<double, 3, at::size> J = Eigen::Matrix<double, 3, at::size>::Zero();
    J.middleCols<3>(at::R) = row.J_R;
    J.middleCols<3>(at::p) = row.J_p;
    J.middleCols<3>(at::pcr) = row.J_pc;
    EXPECT_LT((J - numeric_jacobian(x, [&](const State& y) { return foot_position(y, point, y.pc[1]).r; })).norm(), 1e-7);
  }
}

TEST(LegMeasurements, TheResidualsAreTheVelocityAndTheOffsetOfAPointFixedToABodyThatTurns) {
  test::Random random(3);
  const State x = test::random_state(random);
  const SolePoint point = random_point(random);
  const Eigen::Vector3d gyro = random.vector3(2);
  constexpr double h = 1e-6;
  const auto place = [&](double s) {
    const SE3 T{x.R * SO3::Exp(s * (gyro - x.bg)), x.p + s * x.v};
    return Eigen::Vector3d(T * (point.p + s * point.v));
  };
  EXPECT_LT((foot_velocity(x, point, gyro).r - (place(h) - place(-h)) / (2 * h)).norm(), 1e-7);
  EXPECT_LT((foot_position(x, point, place(0)).r).norm(), 1e-13);
}

TEST(LegMeasurements, TheModelHoldsTwelveRowsForTwoFeetAndEachFootHasItsOwnColumns) {
  test::Random random(4);
  Estimate e = random_estimate(random, 0.1);
  const LegConfig config;
  LegStep step = both_stand();
  const Eigen::Vector3d gyro = random.vector3(0.1);
  for (std::size_t side = 0; side < 2; ++side) {
    Stance& foot = step.foot[side];
    foot.used = true;
    foot.point = random_point(random);
    e.x.pc[side] = e.x.pose() * foot.point.p;
    foot.point.v = resting(e.x, foot.point.p, gyro);
  }
  LegModel model(step, gyro, config);
  const Rows<LegModel::max_leg_rows> both = model(e.x, e.P);
  ASSERT_EQ(both.r.size(), 12);
  EXPECT_TRUE(model.used().motion[0] && model.used().motion[1]);
  const Eigen::Matrix3d minus = -Eigen::Matrix3d::Identity();
  EXPECT_EQ(Eigen::Matrix3d(both.H.block<3, 3>(3, at::pcl)), minus);
  EXPECT_EQ(Eigen::Matrix3d(both.H.block<3, 3>(9, at::pcr)), minus);
  EXPECT_TRUE((both.H.block<6, 3>(0, at::pcr).isZero(0)));
  EXPECT_TRUE((both.H.block<6, 3>(6, at::pcl).isZero(0)));
  EXPECT_GT(both.R.diagonal().minCoeff(), 0);
  step.foot[0].used = false;
  const Rows<LegModel::max_leg_rows> right = model(e.x, e.P);
  ASSERT_EQ(right.r.size(), 6);
  EXPECT_EQ(Eigen::VectorXd(right.r), Eigen::VectorXd(both.r.tail<6>()));
  EXPECT_EQ(Eigen::MatrixXd(right.H), Eigen::MatrixXd(both.H.bottomRows<6>()));
  step.foot[1].used = false;
  EXPECT_EQ(model(e.x, e.P).r.size(), 0);
}

// A foot that is beyond the gate is never thrown away: with a wrong velocity all feet are, and nothing else would mend it.
TEST(LegMeasurements, AFootThatIsFarFasterThanTheStateAllowsCountsLessAndTheOtherAsBefore) {
  Estimate e = sure_of_itself();
  const LegConfig config;
  LegStep step = both_stand();
  LegModel model(step, Eigen::Vector3d::Zero(), config);
  const Rows<LegModel::max_leg_rows> before = model(e.x, e.P);
  EXPECT_EQ(model.used().fits, (std::array<bool, 2>{true, true}));
  step.foot[0].point.v = {2, 0, 0};
  const Rows<LegModel::max_leg_rows> rows = model(e.x, e.P);
  ASSERT_EQ(rows.r.size(), 12);
  EXPECT_EQ(model.used().fits, (std::array<bool, 2>{false, true}));
  EXPECT_GT(rows.R(0, 0), 2 * before.R(0, 0));
  EXPECT_EQ(rows.R(6, 6), before.R(6, 6));
  e.P.diagonal().segment<3>(at::v).setConstant(4);
  const Rows<LegModel::max_leg_rows> unknown = model(e.x, e.P);
  EXPECT_EQ(unknown.R(0, 0), before.R(0, 0)) << "a state that knows nothing of its velocity cannot judge";
}

// Eq. 8 loosens what moves, but no foot can loosen its own gate.
TEST(LegMeasurements, TheGateDoesNotOpenForAFootThatIsLooseBecauseItMoves) {
  Estimate e = sure_of_itself();
  const LegConfig config;
  LegStep step = both_stand();
  LegModel model(step, Eigen::Vector3d::Zero(), config);
  step.foot[0].variance_scale = 100;
  step.foot[0].point.v = {0.25, 0, 0};
  model(e.x, e.P);
  EXPECT_EQ(model.used().fits, (std::array<bool, 2>{false, true}));
  step.foot[0].point.v = {0.1, 0, 0};
  model(e.x, e.P);
  EXPECT_EQ(model.used().fits, (std::array<bool, 2>{true, true})) << "soles settle and roll";
}

TEST(LegMeasurements, TheGateClosesForAFootThatIsNotWhereItStood) {
  Estimate e;
  const LegConfig config;
  LegStep step = both_stand();
  LegModel model(step, Eigen::Vector3d::Zero(), config);
  e.x.pc[1] = {0, 0.03, 0};
  model(e.x, e.P);
  EXPECT_EQ(model.used().fits, (std::array<bool, 2>{true, false}));
  e.P.diagonal().segment<3>(at::pcr).setConstant(1e-4);
  model(e.x, e.P);
  EXPECT_EQ(model.used().fits, (std::array<bool, 2>{true, true})) << "after a while it may have moved so far";
}

TEST(LegMeasurements, AFootThatComesDownBesideAnotherIsAtItsLevel) {
  Estimate e;
  e.P.diagonal().setConstant(1e-4);
  const LegConfig config;
  LegStep step = both_stand();
  e.x.pc[0] = {0, 0.1, 0.01};
  step.foot[0].level = GroundPatch{Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero(), 0.005};
  LegModel model(step, Eigen::Vector3d::Zero(), config);
  const auto rows = model(e.x, e.P);
  ASSERT_EQ(rows.r.size(), 13);
  EXPECT_NEAR(rows.r[6], 0.01, 1e-12);
  EXPECT_EQ(rows.H(6, at::pcl + 2), 1);
  EXPECT_EQ(rows.H(6, at::pcr + 2), -1);
  EXPECT_NEAR(rows.R(6, 6), 0.005 * 0.005, 1e-15);
  EXPECT_EQ(LegModel::residual(step, e.x, Eigen::Vector3d::Zero(), model.used()), rows.r);
}

TEST(LegMeasurements, TheJacobianOfTheHeightIsWhatCentralDifferencesSay) {
  test::Random random(12);
  for (int i = 0; i < 20; ++i) {
    const State x = test::random_state(random);
    const bool measures_gravity = i % 2 == 1;
    const GroundPatch ground{random.vector3(1).normalized(), random.vector3(2), 0.01, measures_gravity};
    const FootHeightRow row = foot_height(ground, x, x.pc[0]);
    EXPECT_NEAR(row.r, (measures_gravity ? Eigen::Vector3d(-x.g.normalized()) : ground.normal).dot(x.pc[0] - ground.point), 1e-12);
    Eigen::Matrix<double, 1, at::size> J = Eigen::Matrix<double, 1, at::size>::Zero();
    J.middleCols<3>(at::pcl) = row.J_pc;
    J.middleCols<3>(at::g) = row.J_g;
    const auto height = [&](const State& y) { return Eigen::Vector3d(foot_height(ground, y, y.pc[0]).r, 0, 0); };
    EXPECT_LT((J - numeric_jacobian(x, height).row(0)).norm(), 1e-7);
  }
}

TEST(LegMeasurements, OnGroundThatIsKnownAFootHasOneMoreRowUnlessItStandsOnSomethingElse) {
  Estimate e;
  e.P.diagonal().setConstant(1e-4);
  const LegConfig config;
  LegStep step = both_stand();
  step.foot[0].used = false;
  step.foot[1].ground = GroundPatch{Eigen::Vector3d::UnitZ(), {5, 5, -0.02}, 0.003};
  LegModel model(step, Eigen::Vector3d::Zero(), config);
  const auto rows = model(e.x, e.P);
  ASSERT_EQ(rows.r.size(), 7);
  EXPECT_NEAR(rows.r[6], 0.02, 1e-12);
  EXPECT_EQ(Eigen::RowVector3d(rows.H.block<1, 3>(6, at::pcr)), Eigen::RowVector3d(0, 0, 1));
  EXPECT_NEAR(std::sqrt(rows.R(6, 6)), 0.003, 1e-12);
  step.foot[1].ground->point.z() = -0.2;
  EXPECT_EQ(model(e.x, e.P).r.size(), 6) << "a stair";
}

// The new contact position as a function of the error of the old state.
TEST(LegMeasurements, TheCovarianceAtTouchdownIsTheDenseAugmentation) {
  test::Random random(5);
  const LegConfig config;
  for (int i = 0; i < 20; ++i) {
    const std::size_t side = static_cast<std::size_t>(i % 2);
    const int pc = at::pcl + 3 * static_cast<int>(side);
    Estimate e;
    e.x = test::random_state(random);
    e.P = random.covariance<at::size>(0.1);
    const SolePoint point = random_point(random);
    const Covariance before = e.P;
    const State x = e.x;
    begin_stance(e, side, point, config);
    EXPECT_LT((e.x.pc[side] - x.pose() * point.p).norm(), 1e-13);
    EXPECT_EQ(e.x.pc[1 - side], x.pc[1 - side]);
    Covariance G = Covariance::Identity();
    G.middleRows<3>(pc) = numeric_jacobian(x, [&](const State& y) { return Eigen::Vector3d(y.pose() * point.p); });
    Covariance dense = G * before * G.transpose();
    dense.diagonal().segment<3>(pc).array() += config.position_sigma * config.position_sigma;
    EXPECT_LT((e.P - dense).norm(), 1e-9);
    EXPECT_LT((e.P - e.P.transpose()).norm(), 1e-15);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Covariance>(e.P).eigenvalues()[0], -1e-12);
  }
}

TEST(LegMeasurements, AtTouchdownTheErrorOfTheContactPositionIsAsItsCovarianceSays) {
  test::Random random(6);
  const LegConfig config;
  Estimate e = random_estimate(random, 0.003);
  const State x = e.x;
  const Covariance before = e.P;
  const SolePoint point = random_point(random);
  begin_stance(e, 0, point, config);
  // The truth is the estimate with a drawn error; where the foot truly is follows from it.
  Eigen::SelfAdjointEigenSolver<Covariance> eig(before);
  const Covariance root = eig.eigenvectors() * eig.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  constexpr int draws = 20000;
  Eigen::Matrix<double, 9, 9> sampled = Eigen::Matrix<double, 9, 9>::Zero();
  for (int i = 0; i < draws; ++i) {
    const ErrorVector d = root * random.vector<at::size>();
    Eigen::Matrix<double, 9, 1> error;
    error.head<6>() = d.head<6>();
    error.tail<3>() = boxplus(x, d).pose() * point.p + random.vector3(config.position_sigma) - e.x.pc[0];
    sampled += error * error.transpose() / draws;
  }
  Eigen::Matrix<double, 9, 9> claimed;
  claimed << e.P.block<6, 6>(0, 0), e.P.block<6, 3>(0, at::pcl), e.P.block<3, 6>(at::pcl, 0), e.P.block<3, 3>(at::pcl, at::pcl);
  const Eigen::Matrix<double, 9, 1> sigma = claimed.diagonal().cwiseSqrt();
  const Eigen::Matrix<double, 9, 9> off = (sampled - claimed).cwiseQuotient(sigma * sigma.transpose());
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 0.05);
}

TEST(LegMeasurements, WhatAFootMayHaveSlidIsInTheVarianceOfItsContactPositionAlongTheGround) {
  Estimate e;
  e.P.setIdentity();
  Stance foot;
  foot.slide_variance = 1e-4;
  move_stance(e, 1, foot);
  Covariance expected = Covariance::Identity();
  expected.diagonal().segment<2>(at::pcr).array() += 1e-4;
  EXPECT_TRUE(e.P.isApprox(expected, 1e-12));
}

TEST(LegMeasurements, AtLiftOffNothingOfTheFootIsLeftAndNothingElseChanges) {
  test::Random random(7);
  Estimate e{Time{}, test::random_state(random), random.covariance<at::size>(0.1)};
  const Covariance before = e.P;
  end_stance(e, 1);
  EXPECT_TRUE((e.P.middleRows<3>(at::pcr).isZero(0)));
  EXPECT_TRUE((e.P.middleCols<3>(at::pcr).isZero(0)));
  EXPECT_EQ((e.P.topLeftCorner<at::pcr, at::pcr>()), (before.topLeftCorner<at::pcr, at::pcr>()));
  EXPECT_EQ(e.P(at::tau, at::tau), before(at::tau, at::tau));
}

}  // namespace leg_measurements_test
}  // namespace kilvo
