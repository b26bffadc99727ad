#include "kilvo/filter/state.hpp"

#include <gtest/gtest.h>
#include <limits>

#include "tests/helpers/random_state.hpp"

namespace kilvo {
namespace state_test {

TEST(State, BoxminusUndoesBoxplus) {
  test::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const State x = test::random_state(random);
    const ErrorVector d = test::random_error(random, x, 0.5);
    EXPECT_LT((boxminus(boxplus(x, d), x) - d).norm(), 1e-12);
  }
}

TEST(State, BoxplusUndoesBoxminus) {
  test::Random random(2);
  for (int i = 0; i < 200; ++i) {
    const State b = test::random_state(random);
    State a = test::random_state(random);
    // Gravities of one length, less than a quarter turn apart.
    a.g = (b.g + random.vector3(2)).normalized() * b.g.norm();
    const State c = boxplus(b, boxminus(a, b));
    EXPECT_LT((c.R.matrix() - a.R.matrix()).norm(), 1e-12);
    EXPECT_LT((c.p - a.p).norm() + (c.v - a.v).norm() + (c.bg - a.bg).norm() + (c.ba - a.ba).norm(), 1e-13);
    EXPECT_LT((c.g - a.g).norm(), 1e-12);
    EXPECT_LT((c.pc[0] - a.pc[0]).norm() + (c.pc[1] - a.pc[1]).norm() + std::abs(c.tau - a.tau), 1e-13);
  }
}

TEST(State, EachPartOfTheErrorMovesItsOwnPart) {
  const State x;
  for (int i = 0; i < at::size; ++i) {
    if (i == at::g + 2) continue;  // along gravity there is nothing to move
    const ErrorVector d = 0.125 * ErrorVector::Unit(i);
    EXPECT_LT((boxminus(boxplus(x, d), x) - d).norm(), 1e-15) << i;
  }
  EXPECT_EQ(boxplus(x, ErrorVector::Unit(at::p + 1)).p, Eigen::Vector3d::UnitY());
  EXPECT_EQ(boxplus(x, ErrorVector::Unit(at::pcr)).pc[1], Eigen::Vector3d::UnitX());
  EXPECT_EQ(boxplus(x, ErrorVector::Unit(at::tau)).tau, 2);
}

TEST(State, RotationErrorsAreOnTheRight) {
  test::Random random(3);
  const State x = test::random_state(random);
  ErrorVector d = ErrorVector::Zero();
  d.head<3>() = Eigen::Vector3d(0.1, -0.2, 0.3);
  EXPECT_LT((boxplus(x, d).R.matrix() - x.R.matrix() * SO3::Exp(d.head<3>()).matrix()).norm(), 1e-14);
}

TEST(State, GravityKeepsItsLengthThroughManySteps) {
  test::Random random(4);
  State x = test::random_state(random);
  for (int i = 0; i < 10000; ++i) x = boxplus(x, random.vector<at::size>(0.1));
  EXPECT_NEAR(x.g.norm(), standard_gravity, 1e-11);
}

// A state that is off by d, turned about the vertical and moved so that it has the heading and the position of the estimate.
TEST(State, AFrameThatBeginsHereKnowsHeadingAndPosition) {
  test::Random random(5);
  for (int i = 0; i < 100; ++i) {
    Estimate e;
    e.x = test::random_state(random);
    const ErrorVector d = test::random_error(random, e.x, 1e-4);
    e.P = d * d.transpose();
    State truth = boxplus(e.x, d);
    const Eigen::Vector3d up = -e.x.g.normalized();
    const SO3 turn = SO3::Exp(-up.dot((truth.R * e.x.R.inverse()).Log()) * up);
    const auto moved = [&, from = truth.p](const Eigen::Vector3d& p) { return Eigen::Vector3d(e.x.p + turn * (p - from)); };
    truth.R = turn * truth.R;
    truth.v = turn * truth.v;
    for (Eigen::Vector3d& foot : truth.pc) foot = moved(foot);
    truth.p = e.x.p;
    const ErrorVector left = boxminus(truth, e.x);
    begin_frame(e);
    // To first order in d.
    EXPECT_LT((e.P - left * left.transpose()).norm(), 1e-3 * left.squaredNorm()) << i;
    EXPECT_LT((e.P.block<3, 3>(at::p, at::p).norm()), 1e-20);
    EXPECT_EQ(e.P, e.P.transpose());
  }
}

TEST(State, AFootThatDoesNotStandStaysOutOfAFrameThatBegins) {
  test::Random random(5);
  Estimate e;
  e.x = test::random_state(random);
  e.P.topLeftCorner<9, 9>().setIdentity();
  e.P.block<3, 3>(at::pcr, at::pcr).setIdentity();
  begin_frame(e);
  EXPECT_TRUE((e.P.middleRows<3>(at::pcl).isZero(0)));
  EXPECT_GT((e.P.block<3, 3>(at::pcr, at::pcr).norm()), 1);
}

TEST(State, ANonFiniteNumberAnywhereIsFound) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(is_finite(Estimate{}));
  for (const double bad : {nan, inf, -inf}) {
    for (int i = at::p; i < at::size; ++i) {
      Estimate e;
      Eigen::Vector3d* parts[] = {&e.x.p, &e.x.v, &e.x.bg, &e.x.ba, &e.x.g, &e.x.pc[0], &e.x.pc[1]};
      (i == at::tau ? e.x.tau : (*parts[i / 3 - 1])[i % 3]) = bad;
      EXPECT_FALSE(is_finite(e)) << i;
    }
    Estimate turned;
    turned.x.R = SO3::Exp({bad, 0, 0});
    EXPECT_FALSE(is_finite(turned));
    Estimate uncertain;
    uncertain.P(17, 3) = bad;
    EXPECT_FALSE(is_finite(uncertain));
  }
}

}  // namespace state_test
}  // namespace kilvo
