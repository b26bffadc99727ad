#include "kilvo/estimator/history.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace history_test {

using std::chrono::milliseconds;

const Time history_start = time_from_ns(1'700'000'000'000'000'000);

ImuSample swaying_imu(int ms) {
  const double s = 1e-3 * ms;
  return {history_start + milliseconds(ms),
          {0.3 * std::sin(7 * s), 0.2 * std::cos(5 * s), 0.4 * std::sin(3 * s)},
          {std::sin(11 * s), std::cos(9 * s), standard_gravity + std::sin(13 * s)}};
}

Estimate first_estimate() {
  Estimate e;
  e.t = history_start;
  e.x.v = {0.3, -0.1, 0};
  e.P.diagonal().segment<9>(at::R).setConstant(1e-4);
  e.P.diagonal().segment<6>(at::bg).setConstant(1e-5);
  return e;
}

// A foot that stands from 10 ms on, where the body's motion says that it stays.
LegStep standing_step(int ms, const Estimate& e, const Eigen::Vector3d& gyro, const Eigen::Vector3d& at_W) {
  LegStep step;
  step.t = history_start + milliseconds(ms);
  step.dt = 0.001;
  Stance& foot = step.foot[0];
  foot.used = true;
  foot.begins = ms == 10;
  foot.point.p = e.x.R.inverse() * (at_W - e.x.p);
  foot.point.v = -(gyro - e.x.bg).cross(foot.point.p) - e.x.R.inverse() * e.x.v;
  return step;
}

// IMU at 200 Hz and, if asked for, a standing foot at 100 Hz.
void play(History& history, int from_ms, int until_ms, bool with_legs = false) {
  for (int ms = from_ms; ms <= until_ms; ms += 5) {
    history.add(swaying_imu(ms));
    history.close(history_start + milliseconds(ms));
    if (!with_legs || ms % 10 != 0 || ms == 0) continue;
    history.take(standing_step(ms, history.now(), swaying_imu(ms).gyro, {0, 0.1, -0.8}));
    history.settle_leg_update();
  }
}

void expect_same_bytes(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.x.R.matrix(), b.x.R.matrix());
  EXPECT_TRUE(boxminus(a.x, b.x).tail<at::size - 3>().isZero(0)) << boxminus(a.x, b.x).transpose();
  EXPECT_TRUE((a.P - b.P).isZero(0));
}

double distance(const SE3& a, const SE3& b) { return (a.p - b.p).norm() + (a.R.inverse() * b.R).Log().norm(); }

TEST(History, TheEstimateOfATimeIsTheBaseCarriedOnToIt) {
  for (const bool with_legs : {false, true}) {
    History history{EstimatorConfig{}};
    history.begin(first_estimate(), std::nullopt);
    play(history, 0, 400, with_legs);
    for (const int ms : {0, 101, 250, 400}) {
      Estimate expected = history.base();
      history.replay().advance(expected, history_start + milliseconds(ms), nullptr);
      const Estimate e = history.at(history_start + milliseconds(ms));
      EXPECT_EQ(e.t, expected.t);
      // It may begin at an estimate on the way, which was closed by the gains of then.
      EXPECT_LT(boxminus(e.x, expected.x).norm(), 1e-4) << ms;
      EXPECT_LT((e.P - expected.P).norm(), 0.01 * expected.P.norm()) << ms;
      ASSERT_TRUE(history.trajectory().at(e.t));
      EXPECT_LT(distance(*history.trajectory().at(e.t), e.x.pose()), 1e-4) << ms;
    }
    EXPECT_LT(boxminus(history.at(history.now().t).x, history.now().x).norm(), 1e-4) << "the newest time is now";
  }
}

// What came since a sweep is propagated again as if the sweep's estimate had been the first.
TEST(History, FromANewBaseItGoesOnAsIfItHadBegunThere) {
  for (const bool with_legs : {false, true}) {
    History history{EstimatorConfig{}}, afresh{EstimatorConfig{}};
    history.begin(first_estimate(), std::nullopt);
    play(history, 0, 400, with_legs);
    const Estimate before = history.now();
    Estimate corrected = history.at(history_start + milliseconds(152));
    corrected.x.p += Eigen::Vector3d(0.02, -0.01, 0.005);
    corrected.x.R = corrected.x.R * SO3::Exp({0, 0, 0.01});
    corrected.P.topLeftCorner<6, 6>() *= 0.1;
    history.rebase(corrected);
    EXPECT_EQ(history.base().t, corrected.t);
    history.advance_to(before.t);
    EXPECT_GT((history.now().x.p - before.x.p).norm(), 0.005) << "the correction is in it";

    Estimate expected = corrected;
    History all{EstimatorConfig{}};
    all.begin(first_estimate(), std::nullopt);
    play(all, 0, 400, with_legs);
    all.replay().advance(expected, before.t, nullptr);
    expect_same_bytes(history.now(), expected);
  }
}

TEST(History, OverTheImuAloneACorrectionOfThePositionIsCarriedOnUnchanged) {
  History history{EstimatorConfig{}};
  history.begin(first_estimate(), std::nullopt);
  play(history, 0, 300);
  const Estimate before = history.now();
  Estimate corrected = history.at(history_start + milliseconds(140));
  const Eigen::Vector3d shift(0.3, -0.2, 0.1);
  corrected.x.p += shift;
  history.rebase(corrected);
  history.advance_to(before.t);
  EXPECT_LT((history.now().x.p - before.x.p - shift).norm(), 1e-12);
  EXPECT_LT((history.now().x.v - before.x.v).norm(), 1e-12);
}

TEST(History, ACorrectionIsNoMotionOfTheTrajectory) {
  History history{EstimatorConfig{}};
  history.begin(first_estimate(), std::nullopt);
  play(history, 0, 300);
  const auto time = [](int ms) { return history_start + milliseconds(ms); };
  Estimate corrected = history.at(time(250));
  const SE3 early = *history.trajectory().at(time(180)), late = *history.trajectory().at(time(230));
  corrected.x.p += Eigen::Vector3d(0.05, 0.02, -0.01);
  corrected.x.R = corrected.x.R * SO3::Exp({0.01, -0.02, 0.03});
  history.correct_trajectory(corrected, Eigen::Vector3d::Zero());
  EXPECT_LT(distance(*history.trajectory().at(time(250)), corrected.x.pose()), 1e-12);
  EXPECT_GT(distance(*history.trajectory().at(time(230)), late), 0.03) << "it moved along";
  const SE3 moved = history.trajectory().at(time(180))->inverse() * *history.trajectory().at(time(230));
  EXPECT_LT(distance(moved, early.inverse() * late), 1e-9);
  EXPECT_FALSE(history.trajectory().at(time(251))) << "what came after is not known any more";
  // A velocity that was wrong by 1 m/s over 70 ms had moved what was before by 70 mm.
  Estimate again = corrected;
  history.correct_trajectory(again, {1, 0, 0});
  const SE3 slower = history.trajectory().at(time(180))->inverse() * *history.trajectory().at(time(250));
  EXPECT_NEAR((slower.p - (early.inverse() * late).p).norm(), 0.07, 0.02);
}

// It sees itself and its feet as before, and goes on as it did.
TEST(History, ARobotThatIsElsewhereTakesItsVelocityAndItsFeetAlong) {
  Estimate before = first_estimate();
  before.x.pc[0] = before.x.pose() * Eigen::Vector3d(0.1, 0.2, -0.8);
  before.P.block<3, 3>(at::pcl, at::pcl).diagonal().setConstant(1e-6);
  History history{EstimatorConfig{}};
  history.begin(before, std::nullopt);
  const SE3 by{SO3::Exp({0, 0, 1.6}), {1.9, -0.4, 0.02}};
  constexpr double turned = 0.02, moved = 0.05;
  const Estimate after = history.moved(by, turned, moved).base();
  EXPECT_LT(distance(after.x.pose(), by * before.x.pose()), 1e-12);
  EXPECT_LT((after.x.R.inverse() * after.x.v - before.x.R.inverse() * before.x.v).norm(), 1e-12);
  EXPECT_LT((after.x.pose().inverse() * after.x.pc[0] - before.x.pose().inverse() * before.x.pc[0]).norm(), 1e-12);
  EXPECT_EQ(after.x.pc[1], before.x.pc[1]) << "does not stand";
  EXPECT_EQ(after.x.g, before.x.g);
  EXPECT_NEAR(after.P(at::R, at::R), before.P(at::R, at::R) + turned * turned, 1e-12);
  play(history, 0, 100);
  History other = history.moved(by, turned, moved);
  const Time early = before.t, late = before.t + milliseconds(90);
  other.record_from(other.base(), late);
  const SE3 here = history.trajectory().at(early)->inverse() * *history.trajectory().at(late);
  EXPECT_LT(distance(other.trajectory().at(early)->inverse() * *other.trajectory().at(late), here), 1e-9) << "no point sees it jump";
  const Eigen::Matrix3d between = after.P.block<3, 3>(at::p, at::p) + after.P.block<3, 3>(at::pcl, at::pcl) -
                                  after.P.block<3, 3>(at::p, at::pcl) - after.P.block<3, 3>(at::pcl, at::p);
  EXPECT_LT(std::sqrt(between.trace()), 0.02 + turned * std::sqrt(2.0)) << "the shift is the same for both, but for the turn";
  EXPECT_GT(after.P(at::pcl, at::pcl), moved * moved);
  EXPECT_TRUE((after.P.block<3, 3>(at::pcr, at::pcr).isZero(0)));
}

// Images between two sweeps are the base soon before the second one: what the sweep shows came with rates of 100 ms, not of 10.
TEST(History, APredictionThatIsDoubtedMayHaveBeenOffSinceTheSweepBeforeNotSinceTheImageBetween) {
  History history{EstimatorConfig{}};
  history.begin(first_estimate(), std::nullopt);
  play(history, 0, 200);
  const Time middle = history_start + milliseconds(150);
  const Estimate at_sweep = history.at(middle - milliseconds(100));
  history.correlate_with_sweep(at_sweep.t + milliseconds(50), at_sweep, at_sweep, true, false);
  history.rebase(history.at(middle - milliseconds(10)));
  constexpr double turned = 0.02, moved = 0.01;
  const auto more = [&](bool biases) {
    return Covariance(history.loosened(middle, turned, moved, biases).value().base().P - history.base().P);
  };
  const auto sigma = [](const Covariance& P, int part) { return std::sqrt(P(part + 1, part + 1)); };
  EXPECT_NEAR(sigma(more(true), at::R), turned, 1e-9);
  EXPECT_NEAR(sigma(more(true), at::p), 0.9 * moved, 1e-9) << "with the velocity, until the base";
  EXPECT_NEAR(sigma(more(true), at::v), moved / 0.1, 1e-9);
  EXPECT_NEAR(sigma(more(true), at::bg), turned / 0.1, 1e-9);
  EXPECT_NEAR(sigma(more(true), at::ba), moved / 0.01, 1e-9);
  EXPECT_NEAR(sigma(more(false), at::v), moved / 0.1, 1e-9);
  EXPECT_EQ(sigma(more(false), at::bg), 0);
  EXPECT_EQ(sigma(more(false), at::ba), 0);
  EXPECT_TRUE(history.loosened(middle + milliseconds(1399), turned, moved, true)) << "sweeps may come once a second";
  EXPECT_FALSE(history.loosened(middle + milliseconds(1401), turned, moved, true)) << "more than 1.5 s after the sweep before";
  EXPECT_TRUE(history.loosened(middle - milliseconds(9), turned, moved, true)) << "or fifty times, with stamps that jitter";
}

TEST(History, BeforeAnySweepIsUsedAPredictionIsDoubtedSinceTheBase) {
  History history{EstimatorConfig{}};
  history.begin(first_estimate(), std::nullopt);
  play(history, 0, 200);
  const Time middle = history_start + milliseconds(150);
  history.rebase(history.at(middle - milliseconds(50)));
  const auto loosened = history.loosened(middle, 0, 0.01, false);
  ASSERT_TRUE(loosened);
  EXPECT_NEAR(loosened->base().P(at::v, at::v) - history.base().P(at::v, at::v), 0.2 * 0.2, 1e-9);
}

TEST(History, HowTheImuMovedIsKnownFromShortlyBeforeTheBase) {
  History history{EstimatorConfig{}};
  history.begin(first_estimate(), std::nullopt);
  play(history, 0, 480);
  const auto time = [](int ms) { return history_start + milliseconds(ms); };
  history.rebase(history.at(time(450)));
  history.advance_to(time(480));
  const auto motion = history.motion_since(time(400));
  ASSERT_TRUE(motion);
  EXPECT_LT(distance(motion->end, history.base().x.pose()), 1e-9);
  EXPECT_GT(distance(motion->begin, motion->end), 0.005);
  ASSERT_TRUE(history.motion_since(time(460))) << "not before the base";
  EXPECT_EQ(distance(history.motion_since(time(460))->begin, history.motion_since(time(460))->end), 0);
  EXPECT_FALSE(history.motion_since(time(100))) << "too long ago";
}

}  // namespace history_test
}  // namespace kilvo
