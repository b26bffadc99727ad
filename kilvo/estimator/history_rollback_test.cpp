#include <gtest/gtest.h>

#include "kilvo/estimator/history.hpp"

namespace kilvo {
namespace history_rollback_test {

using std::chrono::milliseconds;

const Time begin_time = time_from_ns(1'700'000'000'000'000'000);

Estimate walking() {
  Estimate e;
  e.t = begin_time;
  e.x.v = {1, 0.5, 0};
  e.P.diagonal().setConstant(1e-4);
  for (std::size_t side = 0; side < 2; ++side) begin_stance(e, side, {.p = {0, 0, -0.7}, .v = {0, 0, 0}}, LegConfig());
  return e;
}

// Two tenths of a second that are remembered as good, and one in which the velocity becomes absurd.
TEST(History, RollsBackToTheLastGoodEstimateOfTodaysTime) {
  History history{EstimatorConfig()};
  history.begin(walking(), std::nullopt);
  for (Duration t{}; t <= milliseconds(300); t += milliseconds(5)) {
    const bool is_wrong = t > milliseconds(200);
    history.add({begin_time + t, {0, 0, 0}, {is_wrong ? 400.0 : 0.0, 0, standard_gravity}});
    history.close(begin_time + t);
    if (!is_wrong) history.remember_good();
  }
  const Eigen::Vector3d p(0.2, 0.1, 0);  // of the last good one
  const Estimate absurd = history.now();
  ASSERT_GT(absurd.x.v.norm(), 30);
  EXPECT_NEAR(history.roll_back(), 0.1, 1e-9);

  const Estimate& e = history.now();
  EXPECT_EQ(e.t, begin_time + milliseconds(300));
  EXPECT_LT((e.x.v - Eigen::Vector3d(1, 0.5, 0)).norm(), 1e-3);
  EXPECT_LT((e.x.p - (p + 0.1 * e.x.v)).norm(), 1e-3) << "it has walked on meanwhile";
  // Anything up to the speed that no robot has; and a walking robot's way of 0.1 s.
  for (int i = 0; i < 3; ++i) {
    EXPECT_GE(e.P(at::v + i, at::v + i), 30.0 * 30.0);
    EXPECT_GE(e.P(at::p + i, at::p + i), 0.03 * 0.03);
  }
  EXPECT_TRUE((e.P.middleRows<6>(at::pcl).isZero(0))) << "no foot stands";
  EXPECT_TRUE((e.P.middleCols<6>(at::pcl).isZero(0)));
  EXPECT_EQ(history.closed().t, e.t);
  EXPECT_EQ(history.base().t, e.t);
  EXPECT_EQ(history.base().P, e.P);
  ASSERT_TRUE(history.trajectory().at(e.t).has_value());
  EXPECT_EQ(history.trajectory().at(e.t)->p, e.x.p);
}

// What comes next goes on from there.
TEST(History, GoesOnAfterARollBack) {
  History history{EstimatorConfig()};
  history.begin(walking(), std::nullopt);
  const auto sample = [](Duration t) { return ImuSample{begin_time + t, {0, 0, 0}, {0, 0, standard_gravity}}; };
  for (Duration t{}; t <= milliseconds(100); t += milliseconds(5)) {
    history.add(sample(t));
    history.close(begin_time + t);
    history.remember_good();
  }
  EXPECT_EQ(history.roll_back(), 0) << "nothing is lost";
  const Estimate back = history.now();
  history.add(sample(milliseconds(105)));
  history.close(begin_time + milliseconds(105));
  EXPECT_LT((history.now().x.p - back.x.p - 0.005 * back.x.v).norm(), 1e-4);
  EXPECT_GT(history.now().P(at::p, at::p), back.P(at::p, at::p));
}

}  // namespace history_rollback_test
}  // namespace kilvo
