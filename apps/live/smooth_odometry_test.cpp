#include "apps/live/smooth_odometry.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace kilvo {
namespace smooth_odometry_test {

// On a circle of 1 m at 0.5 m/s, `jump` beside it from 2 s on.
Output on_circle(double s, const Eigen::Vector3d& jump) {
  constexpr double rate = 0.5;
  Output o;
  o.t = time_from_ns(0) + from_seconds(s);
  o.x.R = SO3::Exp({0, 0, rate * s});
  o.x.p = Eigen::Vector3d(std::sin(rate * s), 1 - std::cos(rate * s), 0);
  o.x.v = rate * Eigen::Vector3d(std::cos(rate * s), std::sin(rate * s), 0);
  o.omega = {0, 0, rate};
  if (s >= 2) {
    o.x.p += jump;
    o.x.R = o.x.R * SO3::Exp(Eigen::Vector3d(0, 0, jump.x()));
  }
  return o;
}

TEST(SmoothOdometry, WithoutCorrectionsItIsTheEstimate) {
  SmoothOdometry smooth(0.5);
  for (int i = 0; i < 4000; ++i) {
    const Output o = on_circle(0.001 * i, Eigen::Vector3d::Zero());
    const SE3 pose = smooth.add(o);
    ASSERT_LT((pose.p - o.x.p).norm(), 1e-6);
    ASSERT_LT((pose.R.inverse() * o.x.R).Log().norm(), 1e-6);
  }
}

TEST(SmoothOdometry, AJumpOfTheEstimateIsBledInWithoutAStep) {
  const Eigen::Vector3d jump(0.3, -0.1, 0.05);
  for (const double period : {0.001, 0.005}) {
    SmoothOdometry smooth(0.5);
    SE3 before;
    for (int i = 0; i < std::lround(8 / period); ++i) {
      const double s = i * period;
      const Output o = on_circle(s, jump);
      const SE3 pose = smooth.add(o);
      if (s > 0) {
        ASSERT_LT((pose.p - before.p).norm(), 1.5 * period + 0.0001) << "at " << s;
        ASSERT_LT((before.R.inverse() * pose.R).Log().norm(), 1.5 * period + 0.0001) << "at " << s;
      }
      before = pose;
    }
    EXPECT_LT((before.p - on_circle(8 - period, jump).x.p).norm(), 1e-4) << "all of it is in";
  }
}

TEST(SmoothOdometry, TakesACorrectionInAsFastAtEveryRate) {
  for (const double period : {0.001, 0.005, 0.01, 0.05}) {
    SmoothOdometry smooth(0.5);
    double left = 0;
    for (int i = 0; i <= std::lround(2.5 / period); ++i) {
      const Output o = on_circle(i * period, {0.5, 0, 0});
      left = (smooth.add(o).p - o.x.p).norm();
    }
    // After one time constant: 0.5 m / e, and what one output is late by.
    EXPECT_NEAR(left, 0.5 * std::exp(-1.0), 0.02) << period;
  }
}

}  // namespace smooth_odometry_test
}  // namespace kilvo
