// Stances in the estimator's own history: what standing, rolling, slipping and stepping feet do to a state that is predicted and updated
// with them.
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

#include "kilvo/estimator/history.hpp"
#include "kilvo/legs/leg_pipeline.hpp"
#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo {
namespace stances_test {

using test::SoleMotion;

// A body that goes on evenly without turning, over feet that do what `sole` says.
struct Scene {
  std::function<SoleMotion(std::size_t side, double s)> sole;
  Eigen::Vector3d v = {0.1, 0, 0};  // of the body, m/s
  State body(double s) const { return test::body_at(Eigen::Vector3d(0, 0, 0.75) + s * v, v); }
};

SoleMotion standing(std::size_t side) { return {{0, side == 0 ? 0.1 : -0.1, 0}}; }

// 0 before `from`, smoothly 1 after `from` + `ramp`, smoothly 0 again at `to`; and its integral from the beginning.
struct Pulse {
  double from, to, ramp;
  double at(double s) const {
    const auto smooth = [](double u) { return std::clamp(u, 0.0, 1.0) * std::clamp(u, 0.0, 1.0) * (3 - 2 * std::clamp(u, 0.0, 1.0)); };
    return smooth((s - from) / ramp) * smooth((to - s) / ramp);
  }
  double integral(double s) const {
    constexpr int steps = 400;
    double sum = 0;
    const double end = std::clamp(s, from, to), h = (end - from) / steps;
    for (int i = 0; i < steps; ++i) sum += at(from + (i + 0.5) * h) * h;
    return sum;
  }
};

class Filter {
 public:
  explicit Filter(Scene scene) : scene_(std::move(scene)), legs_(config_.legs), history_(config_) {
    first.t = test::gait_begin;
    first.x = scene_.body(0);
    first.P.diagonal().segment<3>(at::R).setConstant(1e-6);
    first.P.diagonal().segment<3>(at::v).setConstant(1e-4);
    first.P.diagonal().segment<3>(at::bg).setConstant(1e-8);
    first.P.diagonal().segment<3>(at::ba).setConstant(1e-4);
  }

  // As Estimator does it; an IMU sample with each leg sample.
  void run(double to, double rate = 1000) {
    if (!history_.has_begun()) history_.begin(first, std::nullopt);
    for (; now_ < to - 1e-9; now_ += 1 / rate) {
      const State truth = scene_.body(now_);
      Feet feet;
      feet.t = test::gait_begin + from_seconds(now_);
      for (std::size_t side = 0; side < 2; ++side) feet.foot[side] = test::seen_from(truth, scene_.sole(side, now_));
      const ImuSample level = {feet.t, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, standard_gravity)};
      history_.add(level);
      history_.close(feet.t);
      const LegStep step = legs_.measure(feet, e(), level, nullptr, StanceTracker::Ground::use).step;
      legs_.judge(step, history_.take(step));
      history_.settle_leg_update();
      for (std::size_t side = 0; side < 2; ++side) {
        begins[side] += step.foot[side].begins ? 1 : 0;
        ends[side] += step.foot[side].ends ? 1 : 0;
        used[side] = step.foot[side].used;
      }
      ASSERT_TRUE(is_finite(e()));
    }
  }

  const Estimate& e() const { return history_.now(); }
  Eigen::Vector3d error() const { return e().x.p - scene_.body(to_seconds(e().t - test::gait_begin)).p; }
  LegPipeline& legs() { return legs_; }

  Estimate first;  // before run()
  std::array<int, 2> begins = {0, 0}, ends = {0, 0};
  std::array<bool, 2> used = {false, false};

 private:
  EstimatorConfig config_;
  Scene scene_;
  double now_ = 0;
  LegPipeline legs_;
  History history_;
};

TEST(Stances, FeetThatStandStillPullAWrongVelocityToTheTruth) {
  Filter filter({[](std::size_t side, double) { return standing(side); }});
  filter.first.x.v += Eigen::Vector3d(0.06, -0.04, 0.03);
  filter.first.P.diagonal().segment<3>(at::v).setConstant(0.01);
  filter.run(0.3);
  EXPECT_LT((filter.e().x.v - Eigen::Vector3d(0.1, 0, 0)).norm(), 0.003);
  EXPECT_LT(std::sqrt(filter.e().P.block<3, 3>(at::v, at::v).trace()), 0.04) << "it was 0.17";
  EXPECT_LT(filter.error().norm(), 0.001);
}

TEST(Stances, FeetThatStandStillKeepThePositionAndFindTheTilt) {
  Filter filter({[](std::size_t side, double) { return standing(side); }});
  filter.first.x.R = SO3::Exp({0.004, -0.003, 0});
  filter.first.P.diagonal().segment<3>(at::R).setConstant(1e-4);
  filter.run(3);
  const Eigen::Vector3d up = filter.e().x.R * Eigen::Vector3d::UnitZ();
  EXPECT_LT(std::hypot(up.x(), up.y()), 0.002) << "it was 0.005";
  EXPECT_LT(filter.error().norm(), 0.01);
}

// The left sole rolls over its front edge while the right foot is in the air.
struct Roll {
  double rate;  // rad/s
  Pulse pulse = {1.3, 1.7, 0.05};
  Pulse flight = {1.0, 2.0, 0.02};

  SoleMotion operator()(std::size_t side, double s) const {
    SoleMotion out = standing(side);
    if (side == 1) {
      out.p.x() += 1.5 * flight.integral(s);
      out.v.x() = 1.5 * flight.at(s);
      return out;
    }
    out.pitch = rate * pulse.integral(s);
    out.pitch_rate = rate * pulse.at(s);
    const Eigen::Vector3d edge(test::sole_front, 0, 0), arm = SO3::Exp({0, out.pitch, 0}) * edge;
    out.p += edge - arm;
    out.v = -Eigen::Vector3d(0, out.pitch_rate, 0).cross(arm);
    return out;
  }
};

TEST(Stances, ASoleThatRollsOverItsFrontEdgeIsHeldByTheEdge) {
  for (const double rate : {1.0, 2.0}) {
    SCOPED_TRACE(rate);
    Filter filter({Roll{rate}});
    filter.run(1.29);
    ASSERT_TRUE(filter.legs().contacts().on[0]);
    ASSERT_FALSE(filter.legs().contacts().on[1]);
    const Eigen::Vector3d before = filter.error();
    EXPECT_NEAR(filter.e().x.pc[0].x(), (test::sole_front + test::sole_back) / 2, 0.003) << "the middle of the sole";
    filter.run(1.5);
    EXPECT_NEAR(filter.e().x.pc[0].x(), test::sole_front, 0.003);
    EXPECT_NEAR(filter.e().x.pc[0].z(), 0, 0.002);
    filter.run(1.7);
    EXPECT_TRUE(filter.legs().contacts().on[0]) << "its edge stands";
    EXPECT_EQ(filter.begins[0], 1);
    EXPECT_LT((filter.error() - before).norm(), 0.001);
  }
}

TEST(Stances, AFootThatSlipsWhileTheOtherStandsCostsHalfOfItsWayAtMost) {
  for (const double speed : {0.05, 0.1, 0.3, 1.0}) {
    SCOPED_TRACE(speed);
    const Pulse slip = {1.0, 1.3, 0.02};
    Filter filter({[=](std::size_t side, double s) {
      SoleMotion out = standing(side);
      if (side == 1) return out;
      out.p.y() += speed * slip.integral(s);
      out.v.y() = speed * slip.at(s);
      return out;
    }});
    filter.run(1.0);
    const Eigen::Vector3d before = filter.error();
    filter.run(2.0);
    EXPECT_LT((filter.error() - before).norm(), 0.5 * speed * slip.integral(2.0) + 0.002);
    EXPECT_LT((filter.e().x.v - Eigen::Vector3d(0.1, 0, 0)).norm(), 0.01);
    EXPECT_TRUE(filter.used[0]) << "and it is used again";
  }
}

TEST(Stances, WhenTheOnlyStandingFootSlipsItsWayIsAllThatIsLost) {
  const Pulse flight = {1.0, 2.0, 0.02}, slip = {1.3, 1.6, 0.02};
  for (const double speed : {0.05, 0.1, 0.3}) {
    SCOPED_TRACE(speed);
    Filter filter({[=](std::size_t side, double s) {
      SoleMotion out = standing(side);
      if (side == 1) {
        out.p.x() += 1.5 * flight.integral(s);
        out.v.x() = 1.5 * flight.at(s);
      } else {
        out.p.y() += speed * slip.integral(s);
        out.v.y() = speed * slip.at(s);
      }
      return out;
    }});
    filter.run(1.3);
    const Eigen::Vector3d before = filter.error();
    filter.run(1.9);
    EXPECT_LT((filter.error() - before).norm(), speed * slip.integral(1.9) + 0.005);
    EXPECT_LT((filter.e().x.v - Eigen::Vector3d(0.1, 0, 0)).norm(), 0.5 * speed) << "the velocity is being found again";
  }
}

TEST(Stances, RowsAreADensityOneKilohertzSaysNoMoreThan200Hertz) {
  const Scene scene{[](std::size_t side, double) { return standing(side); }};
  Filter fast(scene), slow(scene);
  fast.run(1, 1000);
  slow.run(1, 200);
  const ErrorVector a = fast.e().P.diagonal(), b = slow.e().P.diagonal();
  for (int i = 0; i < at::ba; ++i) EXPECT_NEAR(a[i] / b[i], 1, 0.1) << "error state " << i;
  const auto to_the_foot = [](const Covariance& P) {
    const auto of = [&P](int row, int col) { return P.block<3, 3>(row, col).trace(); };
    return of(at::p, at::p) + of(at::pcl, at::pcl) - 2 * of(at::p, at::pcl);
  };
  EXPECT_NEAR(to_the_foot(fast.e().P) / to_the_foot(slow.e().P), 1, 0.12);
}

TEST(Stances, AfterARestartBothFeetLeaveAndEnterAnewInOneStep) {
  Filter filter({[](std::size_t side, double) { return standing(side); }});
  filter.run(0.2);
  filter.legs().restart();
  filter.run(0.4);
  EXPECT_EQ(filter.begins, (std::array<int, 2>{2, 2}));
  EXPECT_EQ(filter.ends, (std::array<int, 2>{1, 1}));
  EXPECT_LT(filter.error().norm(), 0.001);
}

}  // namespace stances_test
}  // namespace kilvo
