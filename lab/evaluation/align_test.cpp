#include "lab/evaluation/align.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

namespace kilvo::lab {
namespace align_test {

using Eigen::Vector3d;
using ::testing::HasSubstr;

const SE3 T_GE{SO3::Exp({0.3, -0.8, 2.5}), {12, -7, 3}};

Time at(double seconds) { return time_from_ns(1700010000000000000) + from_seconds(seconds); }

/// Something that turns and moves in all directions; analytic, so that any time may be asked for.
SE3 curl(double s) {
  return {SO3::Exp({0.2 * std::sin(s), 0.3 * std::cos(2 * s), 0.5 * s}), {3 * std::sin(s), 2 * std::cos(0.7 * s), 0.3 * std::sin(3 * s)}};
}

/// Pairs whose estimate is the truth seen from a world displaced by T_GE.
template <class Motion>
std::vector<PosePair> displaced(Motion motion, const SE3& T, int count = 200) {
  std::vector<PosePair> pairs;
  pairs.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) pairs.push_back({at(0.1 * i), T.inverse() * motion(0.1 * i), motion(0.1 * i)});
  return pairs;
}

void expect_same(const SE3& a, const SE3& b, double tolerance = 1e-9) {
  EXPECT_LT((a.p - b.p).norm(), tolerance);
  EXPECT_LT((a.R.inverse() * b.R).Log().norm(), tolerance);
}

TEST(Align, Se3RecoversAKnownTransform) { expect_same(align(displaced(curl, T_GE), Alignment::se3), T_GE); }

TEST(Align, Se3RecoversTheTransformOfAPlanarWalkWithoutMirroringIt) {
  const auto circle = [](double s) { return SE3{SO3::Exp({0, 0, s}), {2 * std::cos(s), 2 * std::sin(s), 0}}; };
  expect_same(align(displaced(circle, T_GE), Alignment::se3), T_GE);
}

TEST(Align, Se3TurnsAboutAStraightLineAsTheOrientationsSay) {
  const auto line = [](double s) { return SE3{SO3::Exp({0.1, 0, 0.2}), {s, 0, 0}}; };
  expect_same(align(displaced(line, T_GE), Alignment::se3), T_GE, 1e-8);
}

TEST(Align, ARobotThatStandsStillIsAlignedByItsOrientation) {
  const auto still = [](double) { return SE3{SO3::Exp({0.1, 0.2, 0.3}), {1, 2, 3}}; };
  expect_same(align(displaced(still, T_GE), Alignment::se3), T_GE);
  const SE3 turned{SO3::Exp({0, 0, 1.2}), {4, 5, 6}};
  expect_same(align(displaced(still, turned), Alignment::yaw), turned);
}

TEST(Align, Se3IsTheLeastSquaresOptimum) {
  auto pairs = displaced(curl, T_GE);
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 0.1);
  for (auto& pair : pairs) pair.T_E.p += Vector3d(normal(random), normal(random), normal(random));
  const auto cost = [&](const SE3& T) {
    double sum = 0;
    for (const auto& pair : pairs) sum += (pair.T_G.p - T * pair.T_E.p).squaredNorm();
    return sum;
  };
  const SE3 best = align(pairs, Alignment::se3);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double step : {-1e-4, 1e-4}) {
      const Vector3d d = step * Vector3d::Unit(axis);
      EXPECT_GT(cost({best.R, best.p + d}), cost(best));
      EXPECT_GT(cost({best.R * SO3::Exp(d), best.p}), cost(best));
    }
  }
}

TEST(Align, YawRecoversATurnAboutZAndLeavesATiltAlone) {
  const SE3 turned{SO3::Exp({0, 0, -2.9}), {4, 5, 6}};
  expect_same(align(displaced(curl, turned), Alignment::yaw), turned);
  const SE3 tilted{SO3::Exp({0.1, 0, 0}), Vector3d::Zero()};
  EXPECT_LT((align(displaced(curl, tilted), Alignment::yaw).R * Vector3d::UnitZ() - Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(Align, FirstLaysTheFirstPoseOnTheTruthWhateverFollows) {
  auto pairs = displaced(curl, T_GE);
  for (std::size_t i = 1; i < pairs.size(); ++i) pairs[i].T_E.p *= 2;
  expect_same(align(pairs, Alignment::first), T_GE);
}

TEST(Align, KnowsItsNames) {
  EXPECT_EQ(alignment_of("se3"), Alignment::se3);
  EXPECT_EQ(alignment_of("yaw"), Alignment::yaw);
  EXPECT_EQ(alignment_of("first"), Alignment::first);
  EXPECT_EQ(alignment_of("sim3"), std::nullopt);
}

/// Constant speed along a line, constant rate about a tilted axis: linear and slerp are exact on it.
SE3 screw(double s) { return {SO3::Exp({0.1, 0.2, 0.3}) * SO3::Exp(Vector3d(0.3, -0.4, 1.0) * s), Vector3d(1, -2, 0.5) * s}; }

std::vector<StampedPose> sampled(double from, double to, double period) {
  std::vector<StampedPose> poses;
  for (int i = 0; from + i * period <= to + 1e-9; ++i) poses.push_back({at(from + i * period), screw(from + i * period)});
  return poses;
}

TEST(Match, InterpolatesTheTruthLinearlyAndBySlerp) {
  const auto pairs = match(sampled(0.033, 9.9, 0.0123), sampled(0, 10, 0.1));
  EXPECT_EQ(pairs.size(), 803u);
  for (const PosePair& pair : pairs) expect_same(pair.T_E, pair.T_G);
}

TEST(Match, TakesTheTruthItselfWhereStampsCoincide) {
  auto truth = sampled(0, 1, 0.1);
  const auto pairs = match(truth, truth);
  ASSERT_EQ(pairs.size(), truth.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) EXPECT_EQ(pairs[i].T_G.R.matrix(), truth[i].T.R.matrix());
}

TEST(Match, LeavesOutEstimatesBeforeAndAfterTheTruth) {
  const auto pairs = match(sampled(0, 10, 0.5), sampled(2, 5, 0.1));
  ASSERT_EQ(pairs.size(), 7u);
  EXPECT_EQ(pairs.front().t, at(2));
  EXPECT_EQ(pairs.back().t, at(5));
}

TEST(Match, DoesNotInventTruthAcrossAHole) {
  auto truth = sampled(0, 10, 0.1);
  truth.erase(truth.begin() + 41, truth.begin() + 60);  // 4.0 s and 6.0 s stay
  const auto pairs = match(sampled(0.05, 9.95, 0.1), truth);
  EXPECT_EQ(pairs.size(), 80u);
  for (const PosePair& pair : pairs) EXPECT_TRUE(pair.t < at(4) || pair.t > at(6));
}

TEST(Match, AcceptsTwoPosesOfTheSameTime) {
  auto truth = sampled(0, 1, 0.1);
  truth.insert(truth.begin() + 3, truth[3]);
  auto estimates = sampled(0, 1, 0.05);
  estimates.insert(estimates.begin() + 5, estimates[5]);
  EXPECT_EQ(match(estimates, truth).size(), 22u);
}

std::string error_of(const std::vector<StampedPose>& estimates, const std::vector<StampedPose>& truth) {
  try {
    match(estimates, truth);
  } catch (const EvaluationError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Match, SaysWhyThereIsTooLittleToCompare) {
  EXPECT_EQ(
      error_of(sampled(9.8, 20, 0.1), sampled(0, 9.9, 0.1)),
      "only 2 estimates lie within the truth's span of time, at least 3 are needed (estimate: 103 poses from 1700010009.800000000 s to "
      "1700010020.000000000 s; truth: 100 poses from 1700010000.000000000 s to 1700010009.900000000 s)");
  EXPECT_THAT(error_of({}, sampled(0, 1, 0.1)), HasSubstr("estimate: no poses"));
  EXPECT_THAT(error_of(sampled(0, 1, 0.1), {}), HasSubstr("truth: no poses"));
}

TEST(Match, RefusesPosesOutOfOrder) {
  auto poses = sampled(0, 1, 0.1);
  std::swap(poses[3], poses[4]);
  EXPECT_THAT(error_of(poses, sampled(0, 1, 0.1)), HasSubstr("not in the order of time"));
}

}  // namespace align_test
}  // namespace kilvo::lab
