#include "kilvo/filter/trajectory.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace trajectory_test {

const Time start = time_from_ns(1'700'000'000'000'000'000);

Time at_ms(std::int64_t ms) { return start + std::chrono::milliseconds(ms); }

// Cubic in position, constant rate in rotation.
struct Motion {
  Eigen::Vector3d a{1, 2, -1}, b{0.5, -1, 0.3}, c{-2, 1, 0.7}, d{3, -2, 1}, rate{0.4, -1, 2};
  SE3 pose(Time t) const {
    const double s = to_seconds(t - start);
    return {SO3::Exp(s * rate), a + s * (b + s * (c + s * d))};
  }
  Eigen::Vector3d velocity(Time t) const {
    const double s = to_seconds(t - start);
    return b + s * (2 * c + s * 3 * d);
  }
};

Trajectory trajectory_along(const Motion& motion, int first_ms, int last_ms, int step_ms, Duration keep = std::chrono::seconds(10)) {
  Trajectory trajectory(keep);
  for (int ms = first_ms; ms <= last_ms; ms += step_ms) trajectory.push(at_ms(ms), motion.pose(at_ms(ms)), motion.velocity(at_ms(ms)));
  return trajectory;
}

void expect_same(const SE3& a, const SE3& b, double tolerance) {
  EXPECT_LT((a.R.inverse() * b.R).Log().norm(), tolerance);
  EXPECT_LT((a.p - b.p).norm(), tolerance);
}

TEST(Trajectory, CubicMotionAtAConstantRateIsInterpolatedExactly) {
  const Motion motion;
  const Trajectory trajectory = trajectory_along(motion, 0, 1000, 50);
  for (int ms = 0; ms <= 1000; ++ms) expect_same(*trajectory.at(at_ms(ms)), motion.pose(at_ms(ms)), 1e-12);
  EXPECT_LT((trajectory.at(at_ms(150))->p - motion.pose(at_ms(150)).p).norm(), 1e-15);
}

TEST(Trajectory, OutsideOfItThereIsNoPose) {
  EXPECT_FALSE(Trajectory(std::chrono::seconds(1)).at(start));
  const Trajectory trajectory = trajectory_along({}, 0, 100, 5);
  EXPECT_TRUE(trajectory.at(at_ms(0)));
  EXPECT_TRUE(trajectory.at(at_ms(100)));
  EXPECT_FALSE(trajectory.at(at_ms(0) - Duration(1)));
  EXPECT_FALSE(trajectory.at(at_ms(100) + Duration(1)));
}

TEST(Trajectory, AnEntryOfTheNewestTimeReplacesItAndAnOlderOneIsIgnored) {
  Trajectory trajectory = trajectory_along({}, 0, 100, 5);
  const std::size_t size = trajectory.size();
  const SE3 other{SO3::Exp({1, 0, 0}), {9, 9, 9}};
  trajectory.push(at_ms(100), other, {});
  EXPECT_EQ(trajectory.size(), size);
  expect_same(*trajectory.at(at_ms(100)), other, 1e-15);
  trajectory.push(at_ms(50), other, {});
  EXPECT_EQ(trajectory.size(), size);
  expect_same(*trajectory.at(at_ms(50)), Motion().pose(at_ms(50)), 1e-12);
}

TEST(Trajectory, ItsSizeIsBoundedAndTheKeptSpanIsAlwaysThere) {
  const Motion motion;
  Trajectory trajectory(std::chrono::milliseconds(500));
  for (int ms = 0; ms < 100'000; ms += 5) {
    trajectory.push(at_ms(ms), SE3{}, Eigen::Vector3d::Zero());
    EXPECT_LE(trajectory.size(), 203U);  // twice the kept span at 200 Hz
    if (ms > 500) {
      ASSERT_LE(trajectory.oldest(), at_ms(ms) - std::chrono::milliseconds(500));
      ASSERT_GE(trajectory.oldest(), at_ms(ms) - std::chrono::milliseconds(1010));
    }
  }
}

TEST(Trajectory, ACorrectionMovesWhatWasBeforeRigidly) {
  const Motion motion;
  const Trajectory before = trajectory_along(motion, 0, 200, 5);
  Trajectory after = before;
  const Time t = at_ms(123);
  const SE3 here = *before.at(t);
  const SE3 corrected{here.R * SO3::Exp({0.002, -0.001, 0.003}), here.p + Eigen::Vector3d(0.003, -0.004, 0)};  // 5 mm
  after.correct(t, corrected, Eigen::Vector3d::Zero());
  after.push(t, corrected, corrected.R * (here.R.inverse() * motion.velocity(t)));
  expect_same(*after.at(t), corrected, 1e-13);
  for (int ms = 0; ms <= 120; ms += 3) {
    const SE3 relative_before = before.at(t)->inverse() * *before.at(at_ms(ms));
    const SE3 relative_after = after.at(t)->inverse() * *after.at(at_ms(ms));
    expect_same(relative_after, relative_before, 1e-12);
  }
  EXPECT_FALSE(after.at(at_ms(130)));
}

TEST(Trajectory, ACorrectionOfTheVelocityBendsWhatWasBefore) {
  const Motion motion;
  Trajectory trajectory = trajectory_along(motion, 0, 200, 5);
  const Time t = at_ms(150);
  const Eigen::Vector3d dv(0.02, -0.01, 0.005);
  trajectory.correct(t, motion.pose(t), dv);
  for (int ms = 0; ms <= 150; ms += 3) {
    const SE3 expected{motion.pose(at_ms(ms)).R, motion.pose(at_ms(ms)).p - dv * to_seconds(t - at_ms(ms))};
    expect_same(*trajectory.at(at_ms(ms)), expected, 1e-12);
  }
}

TEST(Trajectory, ACorrectionOutsideOfItDoesNothing) {
  Trajectory trajectory = trajectory_along({}, 0, 100, 5);
  trajectory.correct(at_ms(101), SE3{}, {});
  trajectory.correct(at_ms(-1), SE3{}, {});
  for (int ms = 0; ms <= 100; ++ms) expect_same(*trajectory.at(at_ms(ms)), Motion().pose(at_ms(ms)), 1e-12);
}

TEST(Trajectory, ClearedItIsEmpty) {
  Trajectory trajectory = trajectory_along({}, 0, 100, 5);
  trajectory.clear();
  EXPECT_EQ(trajectory.size(), 0U);
  EXPECT_FALSE(trajectory.at(at_ms(50)));
}

}  // namespace trajectory_test
}  // namespace kilvo
