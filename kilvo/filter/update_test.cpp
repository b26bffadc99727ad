#include "kilvo/filter/update.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "tests/helpers/random_state.hpp"

namespace kilvo {
namespace update_test {

using Matrix = Eigen::MatrixXd;

const UpdateConfig to_the_end{100, 1e-12, 1e-12};

Estimate random_prior(test::Random& random, double sigma) {
  return {time_from_ns(1), test::random_state(random), random.covariance<at::size>(sigma)};
}

// Rows that measure x [-] reference linearly: r = H (x [-] reference) + offset.
template <int N>
struct LinearModel {
  Matrix H, R;
  Eigen::VectorXd offset;
  State reference;
  Rows<N> operator()(const State& x, const Covariance&) const { return {offset + H * boxminus(x, reference), H, R}; }
};

LinearModel<12> random_model(test::Random& random, const State& reference, int rows, int first, int columns) {
  LinearModel<12> m;
  m.H = Matrix::Zero(rows, at::size);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) m.H(i, first + j) = random.normal();
  }
  m.R = (Eigen::VectorXd::Ones(rows) * 0.01).asDiagonal();
  for (int i = 0; i < rows; ++i) m.R(i, i) *= random.uniform(0.5, 2);
  m.offset = Eigen::VectorXd::NullaryExpr(rows, [&] { return random.normal(0.05); });
  m.reference = reference;
  return m;
}

Information<6> sum_of(const Rows<12>& rows) {
  Information<6> info;
  info.columns = {at::R, at::R + 1, at::R + 2, at::p, at::p + 1, at::p + 2};
  const Matrix W = Matrix(rows.R).inverse(), H = rows.H.leftCols<6>();
  info.A = H.transpose() * W * H;
  info.b = H.transpose() * W * rows.r;
  info.chi2 = rows.r.dot(W * rows.r);
  info.rows = static_cast<int>(rows.r.size());
  return info;
}

void expect_same(const Estimate& a, const Estimate& b, double tolerance) {
  EXPECT_LT(boxminus(a.x, b.x).norm(), tolerance);
  EXPECT_LT((a.P - b.P).norm(), tolerance);
}

TEST(Update, ALinearProblemGivesTheTextbookAnswer) {
  test::Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Estimate prior = random_prior(random, 0.3);
    LinearModel<12> model = random_model(random, prior.x, 7, 0, at::size);
    // Neither rotation nor gravity: those are not flat. Their estimates still move by correlation, but little matters where.
    model.H.middleCols<3>(at::R).setZero();
    model.H.middleCols<3>(at::g).setZero();
    const Update u = update(prior, model, UpdateConfig{1, 0, 0});
    const Matrix S = model.H * prior.P * model.H.transpose() + model.R;
    const Matrix K = prior.P * model.H.transpose() * S.inverse();
    const ErrorVector step = -K * model.offset;
    EXPECT_LT(boxminus(u.posterior.x, boxplus(prior.x, step)).norm(), 1e-12);
    EXPECT_LT((u.posterior.P - (Covariance::Identity() - K * model.H) * prior.P).norm(), 1e-12);
    EXPECT_EQ(u.rows, 7);
    EXPECT_EQ(u.posterior.t, prior.t);
  }
}

TEST(Update, ALinearProblemIsDoneAfterOneStep) {
  test::Random random(2);
  Estimate prior = random_prior(random, 0.3);
  prior.P.middleRows<3>(at::R).setZero();
  prior.P.middleCols<3>(at::R).setZero();
  prior.P.middleRows<3>(at::g).setZero();
  prior.P.middleCols<3>(at::g).setZero();
  const LinearModel<12> model = random_model(random, prior.x, 9, at::p, 12);
  const Update once = update(prior, model, UpdateConfig{1, 0, 0}), often = update(prior, model, to_the_end);
  EXPECT_FALSE(once.converged);
  EXPECT_TRUE(often.converged);
  EXPECT_EQ(often.iterations, 2);
  expect_same(once.posterior, often.posterior, 1e-12);
}

TEST(Update, InformationAndRowsGiveTheSamePosterior) {
  test::Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Estimate prior = random_prior(random, 0.3);
    const int rows = 1 + trial % 12;  // fewer than six as well: singular information
    const LinearModel<12> model = random_model(random, prior.x, rows, at::R, 6);
    const auto summed = [&model](const State& x, const Covariance& P) { return sum_of(model(x, P)); };
    const Update a = update(prior, model, UpdateConfig{3, 0, 0}), b = update(prior, summed, UpdateConfig{3, 0, 0});
    expect_same(a.posterior, b.posterior, 1e-10);
    EXPECT_EQ(a.iterations, b.iterations);
    EXPECT_EQ(b.rows, std::min(rows, 6));
  }
}

// Noise of the pose that all rows share and that goes with the prior's error, against the textbook with that noise as six more states.
TEST(Update, NoiseThatGoesWithThePriorsErrorIsAsIfItWereAState) {
  test::Random random(7);
  constexpr int N = at::size + 6;
  for (int trial = 0; trial < 20; ++trial) {
    const Matrix joint = random.covariance<N>(0.1);
    Estimate prior{time_from_ns(1), test::random_state(random), joint.topLeftCorner<at::size, at::size>()};
    const PoseCovariance V = joint.bottomRightCorner<6, 6>();
    // Only the pose's error goes with it.
    const PoseCovariance shared = -0.3 * Matrix(V.diagonal().cwiseMin(prior.P.diagonal().head<6>()).asDiagonal());
    Matrix P = Matrix::Zero(N, N);
    P.topLeftCorner<at::size, at::size>() = prior.P;
    P.bottomRightCorner<6, 6>() = V;
    P.block<6, 6>(0, at::size) = shared;
    P.block<6, 6>(at::size, 0) = shared.transpose();
    LinearModel<12> model = random_model(random, prior.x, 8, 0, 6);
    Matrix H(8, N);
    H << model.H, model.H.leftCols<6>();
    const Matrix gain = P * H.transpose() * (H * P * H.transpose() + model.R).inverse();
    const Matrix expected = (Matrix::Identity(N, N) - gain * H) * P;
    const ErrorVector step = -(gain * model.offset).head<at::size>();

    model.R += model.H.leftCols<6>() * V * model.H.leftCols<6>().transpose();
    const Update u = update(prior, model, UpdateConfig{1, 0, 0}, &shared);
    EXPECT_LT((u.posterior.P - expected.topLeftCorner<at::size, at::size>()).norm(), 1e-9);
    EXPECT_LT(boxminus(u.posterior.x, boxplus(prior.x, step)).norm(), 1e-9);
  }
}

TEST(Update, InformationInUnitsFarApartLosesNothing) {
  test::Random random(4);
  Estimate prior = random_prior(random, 0.01);
  LinearModel<12> model = random_model(random, prior.x, 12, at::R, 6);
  model.H.leftCols<3>() *= 1e4;  // rotation known to microradians, position to decimetres
  const auto summed = [&model](const State& x, const Covariance& P) { return sum_of(model(x, P)); };
  const UpdateConfig once{1, 0, 0};
  const Estimate a = update(prior, model, once).posterior, b = update(prior, summed, once).posterior;
  EXPECT_LT(boxminus(a.x, b.x).norm(), 1e-9);
  for (int i = 0; i < at::size; ++i) EXPECT_NEAR(a.P(i, i) / b.P(i, i), 1, 1e-6) << i;
}

// Points known in the world, seen from the pose: r = R'(l - p) - z.
struct Landmarks {
  std::vector<Eigen::Vector3d> l_W, z_I;
  double sigma = 0.05;
  Rows<12> operator()(const State& x, const Covariance&) const {
    Rows<12> rows;
    const auto count = static_cast<Eigen::Index>(3 * l_W.size());
    rows.r.resize(count);
    rows.H.setZero(count, at::size);
    rows.R = Matrix::Identity(count, count) * sigma * sigma;
    for (std::size_t i = 0; i < l_W.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(3 * i);
      const Eigen::Vector3d seen = x.R.inverse() * (l_W[i] - x.p);
      rows.r.segment<3>(row) = seen - z_I[i];
      rows.H.block<3, 3>(row, at::R) = skew(seen);
      rows.H.block<3, 3>(row, at::p) = -x.R.matrix().transpose();
    }
    return rows;
  }
};

// The minimum of |x [-] prior|^2_P^-1 + |r|^2_R^-1 by Gauss-Newton with numeric derivatives.
State brute_force_map(const Estimate& prior, const Landmarks& model) {
  const Matrix L = Matrix(prior.P.llt().matrixL()).inverse();
  const auto cost = [&](const State& x) {
    const auto rows = model(x, prior.P);
    Eigen::VectorXd c(at::size + rows.r.size());
    c << L * boxminus(x, prior.x), rows.r / model.sigma;
    return c;
  };
  State x = prior.x;
  for (int k = 0; k < 100; ++k) {
    const Eigen::VectorXd c = cost(x);
    Matrix J(c.size(), +at::size);
    for (int i = 0; i < at::size; ++i) {
      const ErrorVector d = 1e-5 * ErrorVector::Unit(i);
      J.col(i) = (cost(boxplus(x, d)) - cost(boxplus(x, -d))) / 2e-5;
    }
    x = boxplus(x, -(J.transpose() * J + 1e-9 * Matrix::Identity(+at::size, +at::size)).ldlt().solve(J.transpose() * c));
  }
  return x;
}

TEST(Update, OnARotationItConvergesToTheMaximumAPosteriori) {
  test::Random random(5);
  for (int trial = 0; trial < 10; ++trial) {
    Estimate prior = random_prior(random, 0.4);
    // Gravity is seen by no landmark and shares no error with the pose here: its step is not what this is about.
    prior.P.middleRows<3>(at::g).setZero();
    prior.P.middleCols<3>(at::g).setZero();
    prior.P.block<3, 3>(at::g, at::g) = 0.01 * Eigen::Matrix3d::Identity();
    const State truth = boxplus(prior.x, 0.5 * random.vector<at::size>(0.6));
    Landmarks model;
    model.sigma = 0.3;  // as vague as the prior, so that both count
    for (int i = 0; i < 3; ++i) {
      model.l_W.push_back(prior.x.p + random.vector3(2));
      model.z_I.push_back(truth.R.inverse() * (model.l_W.back() - truth.p) + random.vector3(0.1));
    }
    const Update u = update(prior, model, to_the_end);
    EXPECT_TRUE(u.converged);
    const State expected = brute_force_map(prior, model);
    EXPECT_GT(boxminus(expected, prior.x).head<3>().norm(), 0.02);
    EXPECT_LT(boxminus(u.posterior.x, expected).norm(), 1e-7) << "turned by " << boxminus(expected, prior.x).head<3>().norm();
  }
}

TEST(Update, WhatThePriorKnowsExactlyStaysAndNothingBreaks) {
  test::Random random(6);
  for (int trial = 0; trial < 20; ++trial) {
    Estimate prior = random_prior(random, 0.3);
    prior.P.topRows<6>().setZero();
    prior.P.leftCols<6>().setZero();
    const Update u = update(prior, random_model(random, prior.x, 12, 0, at::size), {});
    EXPECT_LT(boxminus(u.posterior.x, prior.x).head<6>().norm(), 1e-15);
    EXPECT_EQ((u.posterior.P.topRows<6>().norm()), 0);
    EXPECT_TRUE(is_finite(u.posterior));
    EXPECT_LT(u.posterior.P.trace(), prior.P.trace());
    Estimate certain = prior;
    certain.P.setZero();
    const Update none = update(certain, random_model(random, prior.x, 12, 0, at::size), {});
    EXPECT_LT(boxminus(none.posterior.x, prior.x).norm(), 1e-14);
    EXPECT_EQ(none.posterior.P, Covariance::Zero());
  }
}

TEST(Update, ADirectionThatNobodyMeasuresKeepsItsVariance) {
  Estimate prior;
  prior.P = 0.04 * Covariance::Identity();
  Information<6> info;
  info.columns = {at::R, at::R + 1, at::R + 2, at::p, at::p + 1, at::p + 2};
  info.A(4, 4) = 1e6;
  info.b(4) = -1e6 * 0.1;  // y is 0.1
  info.rows = 100;
  const Update u = update(
      prior,
      [&](const State& x, const Covariance&) {
        Information<6> now = info;
        now.b(4) = 1e6 * (x.p.y() - 0.1);
        return now;
      },
      to_the_end);
  EXPECT_EQ(u.rows, 1);
  EXPECT_NEAR(u.posterior.x.p.y(), 0.1, 1e-5);
  EXPECT_NEAR(u.posterior.P(at::p + 1, at::p + 1), 1e-6, 1e-9);
  for (const int i : {0, 1, 2, 3, 5}) EXPECT_NEAR(u.posterior.P(i, i), 0.04, 1e-15) << i;
  EXPECT_EQ(u.posterior.x.p.x(), 0);
  EXPECT_EQ(u.posterior.x.p.z(), 0);
}

TEST(Update, WithoutRowsThePosteriorIsThePrior) {
  test::Random random(7);
  const Estimate prior = random_prior(random, 0.3);
  const Update few = update(prior, [](const State&, const Covariance&) { return Rows<6>{}; }, {});
  const Update many = update(prior, [](const State&, const Covariance&) { return Information<6>{}; }, {});
  for (const Update& u : {few, many}) {
    EXPECT_EQ(u.posterior.x.R.matrix(), prior.x.R.matrix());
    EXPECT_EQ(boxminus(u.posterior.x, prior.x).tail<22>().norm(), 0);
    EXPECT_EQ(u.posterior.P, prior.P);
    EXPECT_EQ(u.rows, 0);
    EXPECT_FALSE(u.converged);
  }
}

TEST(Update, TheCovarianceShrinksAndIsSymmetricToTheBit) {
  test::Random random(8);
  for (int trial = 0; trial < 50; ++trial) {
    const Estimate prior = random_prior(random, 0.3);
    const Covariance P = update(prior, random_model(random, prior.x, 7, 0, at::size), {}).posterior.P;
    EXPECT_EQ(P, P.transpose());
    EXPECT_EQ(P.llt().info(), Eigen::Success);
    EXPECT_LT(P.trace(), prior.P.trace());
  }
}

}  // namespace update_test
}  // namespace kilvo
