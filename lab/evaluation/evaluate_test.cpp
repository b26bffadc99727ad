#include "lab/evaluation/evaluate.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

namespace kilvo::lab {
namespace evaluate_test {

using Eigen::Vector3d;
using ::testing::HasSubstr;

Time at(double seconds) { return time_from_ns(1700010000000000000) + from_seconds(seconds); }

template <class Motion>
std::vector<StampedPose> sampled(Motion motion, double duration, double rate) {
  std::vector<StampedPose> poses;
  for (int i = 0; i <= static_cast<int>(std::lround(duration * rate)); ++i) poses.push_back({at(i / rate), motion(i / rate)});
  return poses;
}

/// Straight ahead at 0.5 m/s.
SE3 line(double s) { return {SO3::Exp({0, 0, 0.4}), SO3::Exp({0, 0, 0.4}) * Vector3d(0.5 * s, 0, 0)}; }
/// Radius 2 m, 0.5 m/s, looking ahead.
SE3 circle(double s) { return {SO3::Exp({0, 0, s / 4 + std::numbers::pi / 2}), {2 * std::cos(s / 4), 2 * std::sin(s / 4), 0.8}}; }

TEST(Evaluate, APerfectEstimateInAnotherWorldHasNoError) {
  const SE3 T{SO3::Exp({0.5, -1, 2}), {100, 20, -5}};
  const auto truth = sampled(circle, 30, 100);
  const auto e = evaluate(sampled([&](double s) { return T * circle(s); }, 30, 100), truth, Alignment::se3);
  EXPECT_EQ(e.estimates, 3001u);
  EXPECT_EQ(e.matches, 3001u);
  EXPECT_LT(e.ate_max_m, 1e-9);
  EXPECT_LT(e.rotation_rmse_deg, 1e-7);
  EXPECT_LT(e.rte_1m_m.value(), 1e-9);
  EXPECT_LT(e.rte_1s_m.value(), 1e-9);
  EXPECT_LT(e.e2e_m, 1e-9);
  EXPECT_NEAR(e.coverage, 1.0, 1e-12);
  EXPECT_NEAR(e.rate_hz, 100.0, 1e-9);
  EXPECT_NEAR(e.duration_s, 30.0, 1e-12);
  EXPECT_NEAR(e.path_length_m, 15.0, 0.01);
  EXPECT_FALSE(judge_divergence(e).diverged);
}

TEST(Evaluate, AScaleErrorOfOnePercentShowsInEveryLength) {
  const auto scaled = [](double s) { return SE3{line(s).R, 1.01 * line(s).p}; };
  const auto e = evaluate(sampled(scaled, 40, 100), sampled(line, 40, 200), Alignment::se3);
  const double length = 20.0, error = 0.01 * length;  // evenly spread over +-error/2 about the middle
  EXPECT_NEAR(e.ate_rmse_m, error / std::sqrt(12.0), 1e-4 * error);
  EXPECT_NEAR(e.ate_max_m, error / 2, 1e-9);
  EXPECT_LT(e.rotation_rmse_deg, 1e-6);
  EXPECT_NEAR(e.rte_1m_m.value(), 0.01, 1e-6);
  EXPECT_NEAR(e.rte_1m_percent.value(), 1.0, 1e-6);
  EXPECT_NEAR(e.rte_1s_m.value(), 0.005, 1e-9);
  EXPECT_NEAR(e.e2e_m, error, 1e-9);
  EXPECT_NEAR(e.e2e_length_m, error, 1e-9);
  EXPECT_NEAR(e.e2e_z_m, 0, 1e-9);
  EXPECT_NEAR(e.path_length_m, length, 1e-9);
}

TEST(Evaluate, AHeadingThatDriftsShowsInRelativeErrors) {
  // Each metre of the estimate bends by 0.02 rad: over 1 m of chord that is an arc of 0.02 rad, off by (s - sin, 1 - cos)/0.02.
  const double bend = 0.02;
  const auto bent = [&](double s) {
    const double d = 0.5 * s;
    return SE3{SO3::Exp({0, 0, bend * d}), {std::sin(bend * d) / bend, (1 - std::cos(bend * d)) / bend, 0}};
  };
  const auto straight = [](double s) { return SE3{SO3(), {0.5 * s, 0, 0}}; };
  const auto e = evaluate(sampled(bent, 40, 100), sampled(straight, 40, 100), Alignment::first);
  const auto off = [&](double d) { return std::hypot(d - std::sin(bend * d) / bend, (1 - std::cos(bend * d)) / bend); };
  EXPECT_NEAR(e.rte_1m_m.value(), off(1.0), 1e-9);
  EXPECT_NEAR(e.rte_1s_m.value(), off(0.5), 1e-9);
  EXPECT_NEAR(e.e2e_m, off(20.0), 1e-9);
  EXPECT_NEAR(e.ate_max_m, off(20.0), 1e-9);
  // Heading error grows evenly from 0 to 0.4 rad: rms 0.4 / sqrt(3).
  EXPECT_NEAR(e.rotation_rmse_deg, 0.4 / std::sqrt(3.0) * 180 / std::numbers::pi, 1e-2);
}

TEST(Evaluate, AlternatingErrorsAreTheirOwnRms) {
  int i = 0;
  const auto shaken = [&](double s) { return SE3{circle(s).R, circle(s).p + Vector3d(0, 0, ++i % 2 ? 0.003 : -0.003)}; };
  const auto truth = sampled(circle, 30, 100);
  const auto estimates = sampled(shaken, 30, 100);
  const auto e = evaluate(estimates, truth, Alignment::se3);
  EXPECT_NEAR(e.ate_rmse_m, 0.003, 2e-6);
  EXPECT_NEAR(e.ate_max_m, 0.003, 2e-5);
  EXPECT_NEAR(e.largest_jump_m, std::hypot(0.006, 0.005), 1e-6);
}

TEST(Evaluate, EndToEndFollowsTheFormulaByHand) {
  // Truth: heading 90 deg, goes (0, 3, 0) in the world: 3 m ahead. Estimate: heading 0, goes (2.9, 0.2, 0.1).
  const SO3 left = SO3::Exp({0, 0, std::numbers::pi / 2});
  std::vector<StampedPose> truth = {{at(0), {left, {5, 5, 1}}}, {at(1), {left, {5, 7, 1}}}, {at(2), {left, {5, 8, 1}}}};
  std::vector<StampedPose> estimates = {{at(0), {}}, {at(1), {SO3(), {1.5, 0, 0}}}, {at(2), {SO3(), {2.9, 0.2, 0.1}}}};
  for (const Alignment alignment : {Alignment::se3, Alignment::yaw, Alignment::first}) {
    const auto e = evaluate(estimates, truth, alignment);
    EXPECT_NEAR(e.e2e_m, std::sqrt(0.1 * 0.1 + 0.2 * 0.2 + 0.1 * 0.1), 1e-12);
    EXPECT_NEAR(e.e2e_z_m, -0.1, 1e-12);  // ended too high
    EXPECT_NEAR(e.e2e_length_m, 3.0 - std::sqrt(2.9 * 2.9 + 0.2 * 0.2 + 0.1 * 0.1), 1e-12);
  }
}

TEST(Evaluate, EndToEndZIsTakenInTheWorldOfATiltedBody) {
  // The body looks straight down: what it calls forward is the world's -z.
  const SO3 down = SO3::Exp({0, std::numbers::pi / 2, 0});
  std::vector<StampedPose> truth = {{at(0), {down, {0, 0, 9}}}, {at(1), {down, {0, 0, 8}}}, {at(2), {down, {0, 0, 7}}}};
  std::vector<StampedPose> estimates = {{at(0), {}}, {at(1), {SO3(), {1, 0, 0}}}, {at(2), {SO3(), {1.5, 0, 0}}}};
  const auto e = evaluate(estimates, truth, Alignment::first);
  EXPECT_NEAR(e.e2e_m, 0.5, 1e-12);
  EXPECT_NEAR(e.e2e_z_m, -0.5, 1e-12);  // 7 m in truth, 7.5 m by the estimate
}

TEST(Evaluate, EndsAreThoseOfTheMatchedPoses) {
  const auto e = evaluate(sampled(circle, 40, 10), sampled(circle, 20, 10), Alignment::se3);
  EXPECT_EQ(e.matches, 201u);
  EXPECT_EQ(e.estimates, 401u);
  EXPECT_LT(e.e2e_m, 1e-9);
}

TEST(Evaluate, CoverageGapAndJumpTellOfAHole) {
  auto estimates = sampled(line, 40, 10);
  estimates.erase(estimates.begin() + 101, estimates.begin() + 150);  // nothing between 10 s and 15 s
  estimates.erase(estimates.begin(), estimates.begin() + 20);         // starts at 2 s
  const auto e = evaluate(estimates, sampled(line, 40, 100), Alignment::se3);
  EXPECT_NEAR(e.coverage, (40.0 - 2.0 - 5.0) / 40.0, 1e-9);
  EXPECT_NEAR(e.largest_gap_s, 5.0, 1e-9);
  EXPECT_NEAR(e.largest_jump_m, 2.5, 1e-9);
  EXPECT_NEAR(e.rate_hz, 331 / 38.0, 1e-9);
}

TEST(Evaluate, JitterOfAFastTruthIsNotWalkedDistance) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1e-4);
  auto truth = sampled([](double) { return SE3{}; }, 20, 1000);
  for (auto& pose : truth) pose.T.p += Vector3d(normal(random), normal(random), normal(random));
  EXPECT_LT(evaluate(truth, truth, Alignment::se3).path_length_m, 0.1);  // summed pose by pose it would be 4.5 m
}

TEST(Evaluate, APauseDoesNotOutweighTheWalk) {
  // 10 m with 2 % error, but standing for 100 s before: the error over 1 m is that of the walk.
  const auto pausing = [](double s) { return SE3{SO3(), {0.5 * std::max(0.0, s - 100), 0, 0}}; };
  const auto scaled = [&](double s) { return SE3{SO3(), 1.02 * pausing(s).p}; };
  const auto e = evaluate(sampled(scaled, 120, 50), sampled(pausing, 120, 50), Alignment::se3);
  EXPECT_NEAR(e.rte_1m_m.value(), 0.02, 2e-4);
  EXPECT_NEAR(e.path_length_m, 10.0, 1e-9);
}

TEST(Evaluate, WhatAShortWalkCannotTellIsLeftOut) {
  const auto e = evaluate(sampled(line, 0.8, 100), sampled(line, 0.8, 100), Alignment::se3);
  EXPECT_FALSE(e.rte_1m_m);
  EXPECT_FALSE(e.rte_1m_percent);
  EXPECT_FALSE(e.rte_1s_m);
}

TEST(Divergence, IsOverAMetreOrOverFivePercentOfTheDistance) {
  Evaluation e;
  e.path_length_m = 10;
  e.ate_max_m = 0.49;
  EXPECT_FALSE(judge_divergence(e).diverged);
  e.ate_max_m = 0.51;
  EXPECT_TRUE(judge_divergence(e).diverged);
  e.path_length_m = 68;
  e.ate_max_m = 0.99;
  EXPECT_FALSE(judge_divergence(e).diverged);
  e.e2e_m = 1.01;
  EXPECT_TRUE(judge_divergence(e).diverged);
  EXPECT_EQ(judge_divergence(e).limit_m, 1.0);
  EXPECT_EQ(judge_divergence(e).error_m, 1.01);
}

TEST(Divergence, AllowsAStandingRobotTenCentimetres) {
  Evaluation e;
  e.ate_max_m = 0.09;
  EXPECT_FALSE(judge_divergence(e).diverged);
  e.ate_max_m = 0.11;
  EXPECT_TRUE(judge_divergence(e).diverged);
}

TEST(Report, JsonHoldsEveryFigure) {
  const auto e = evaluate(sampled(
                              [](double s) {
                                return SE3{line(s).R, 1.01 * line(s).p};
                              },
                              10, 20),
                          sampled(line, 10, 100), Alignment::yaw);
  const auto json = nlohmann::json::parse(to_json(e));
  EXPECT_EQ(json.size(), 20u);
  EXPECT_EQ(json["align"], "yaw");
  EXPECT_EQ(json["matches"], 201);
  EXPECT_EQ(json["ate_rmse_m"].get<double>(), e.ate_rmse_m);
  EXPECT_EQ(json["rte_1m_percent"].get<double>(), *e.rte_1m_percent);
  EXPECT_EQ(json["e2e_m"].get<double>(), e.e2e_m);
  EXPECT_EQ(json["diverged"], false);
  const auto brief = nlohmann::json::parse(to_json(evaluate(sampled(line, 0.5, 100), sampled(line, 0.5, 100), Alignment::se3)));
  EXPECT_TRUE(brief["rte_1m_m"].is_null());
}

TEST(Report, TextReadsInMillimetresAndMetres) {
  Evaluation e;
  e.estimates = 2351;
  e.matches = 2350;
  e.ate_rmse_m = 0.0046;
  e.ate_max_m = 1.25;
  e.e2e_z_m = -0.0012;
  e.rte_1m_m = 0.0032;
  e.rte_1m_percent = 0.32;
  e.path_length_m = 35.216;
  e.duration_s = 235;
  e.coverage = 0.998;
  const std::string text = to_text(e);
  EXPECT_THAT(text, HasSubstr("2350 of 2351 estimates, 99.8 % of 235.0 s, path 35.22 m, aligned by se3"));
  EXPECT_THAT(text, HasSubstr("rmse 4.60 mm, max 1.250 m"));
  EXPECT_THAT(text, HasSubstr("z -1.20 mm"));
  e.e2e_z_m = -1e-17;
  EXPECT_THAT(to_text(e), HasSubstr("z 0.00 mm"));
  EXPECT_THAT(text, HasSubstr("3.20 mm (0.320 %)"));
  EXPECT_THAT(text, HasSubstr("unknown (too short)"));
  EXPECT_THAT(text, HasSubstr("YES (error 1.250 m, limit 1.000 m)"));
}

}  // namespace evaluate_test
}  // namespace kilvo::lab
