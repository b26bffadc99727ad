#include "kilvo/estimator/replay.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/predict.hpp"
#include "tests/helpers/random_state.hpp"

namespace kilvo {
namespace replay_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;

const Time begin_time = time_from_ns(1'700'000'000'000'000'000);

ImuSample imu_at(Duration since) {
  const double s = to_seconds(since);
  return {begin_time + since,
          {0.3 * std::sin(7 * s), 0.2 * std::cos(5 * s), 0.4 * std::sin(3 * s)},
          {std::sin(11 * s), std::cos(9 * s), standard_gravity + 2 * std::sin(13 * s)}};
}

// Feet at rest under a body that sways; the right one stands from 0.1 s to 0.3 s.
LegStep leg_at(Duration since) {
  const double s = to_seconds(since);
  LegStep step;
  step.t = begin_time + since;
  step.dt = 0.001;
  for (std::size_t side = 0; side < 2; ++side) {
    Stance& foot = step.foot[side];
    foot.begins = side == 0 ? since == microseconds(1000) : since == milliseconds(100);
    foot.ends = side == 1 && since == milliseconds(300);
    foot.used = side == 0 || (since >= milliseconds(100) && since < milliseconds(300));
    foot.point.p = {0.05 * std::sin(4 * s), side == 0 ? 0.1 : -0.1, -0.75};
    foot.point.v = {0.2 * std::cos(4 * s), 0.01, 0};
    if (!foot.begins) foot.shift = {1e-5, 0, 0};
    foot.variance_scale = 1 + s;
  }
  return step;
}

// IMU at 200 Hz and legs at 1 kHz for so long; the legs a little beside the IMU, or none.
Replay recorded(Duration length, Duration beside = microseconds(0), bool with_legs = true) {
  EstimatorConfig config;
  config.legs.gate = 50;  // these feet slide
  Replay replay(config);
  for (Duration t{}; t <= length; t += milliseconds(5)) replay.add(imu_at(t));
  for (Duration t = milliseconds(1); with_legs && t <= length; t += milliseconds(1)) {
    LegStep step = leg_at(t);
    step.t += beside;
    replay.add(step);
  }
  return replay;
}

Estimate start() {
  test::Random random(1);
  Estimate e;
  e.t = begin_time;
  e.x.R = SO3::Exp({0.02, -0.03, 0.5});
  e.x.v = {0.1, 0, 0};
  e.x.bg = {0.002, -0.001, 0.003};
  e.P = random.covariance<at::size>(0.01);
  for (std::size_t side = 0; side < 2; ++side) end_stance(e, side);
  return e;
}

Estimate advanced(const Replay& replay, Estimate e, Time until) {
  Trajectory record(std::chrono::seconds(2));
  replay.advance(e, until, &record);
  return e;
}

void expect_same(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.x.R.matrix(), b.x.R.matrix());
  EXPECT_TRUE(boxminus(a.x, b.x).tail<at::size - 3>().isZero(0)) << boxminus(a.x, b.x).transpose();
  EXPECT_TRUE((a.P - b.P).isZero(0));
}

TEST(Replay, InPiecesThatEndAtSamplesItIsTheSameBytesAsInOneGo) {
  const Replay replay = recorded(milliseconds(400));
  const Time end = begin_time + milliseconds(400);
  const Estimate whole = advanced(replay, start(), end);
  EXPECT_GT(boxminus(whole.x, start().x).norm(), 0.01) << "something happened";
  for (const Duration piece : {milliseconds(1), milliseconds(5), milliseconds(17), milliseconds(100)}) {
    Estimate e = start();
    for (Time t = begin_time + piece; t < end; t += piece) e = advanced(replay, e, t);
    expect_same(advanced(replay, e, end), whole);
  }
}

TEST(Replay, InPiecesThatEndAnywhereItIsTheSameButForTheStepOfIntegration) {
  // Of the IMU alone: rows of feet that slide as these do are not linear, and carry the difference of the steps on.
  const Replay replay = recorded(milliseconds(400), microseconds(300), false);
  const Time end = begin_time + milliseconds(400);
  const Estimate whole = advanced(replay, start(), end);
  Estimate e = start();
  for (Time t = begin_time + microseconds(3333); t < end; t += microseconds(3333)) e = advanced(replay, e, t);
  e = advanced(replay, e, end);
  EXPECT_EQ(e.t, whole.t);
  EXPECT_LT(boxminus(e.x, whole.x).norm(), 1e-5);
  EXPECT_LT((e.P - whole.P).norm(), 1e-3 * whole.P.norm());
}

TEST(Replay, BetweenTwoSamplesBothAreUsedAndAfterTheNewestItIsHeld) {
  const Replay replay = recorded(milliseconds(5), {}, false);
  const ImuSample a = imu_at({}), b = imu_at(milliseconds(5));
  const Time middle = begin_time + milliseconds(2), later = b.t + milliseconds(3);
  const ProcessNoise noise = EstimatorConfig{}.noise;
  Estimate expected = test::predict(start(), ImuInterval::between(a, b, a.t, middle), {}, noise);
  expect_same(advanced(replay, start(), middle), expected);
  expected = test::predict(expected, ImuInterval::between(a, b, middle, b.t), {}, noise);
  expected = test::predict(expected, ImuInterval::hold(b, b.t, later), {}, noise);
  expect_same(advanced(replay, advanced(replay, start(), middle), later), expected);
}

TEST(Replay, AHeldSampleOfAnImpactIsNotTakenForTheEndOfTheRange) {
  Replay replay{EstimatorConfig{}};
  replay.add(imu_at(milliseconds(0)));
  ImuSample impact = imu_at(milliseconds(5));
  impact.accel.z() = 60;
  replay.add(impact);
  Estimate e = start();
  replay.predict_to(e, begin_time + milliseconds(5), nullptr);
  const Covariance before = e.P;
  replay.predict_to(e, begin_time + milliseconds(9), nullptr);
  EXPECT_LT(e.P(at::R, at::R), before(at::R, at::R) + 1e-5) << "3 rad/s of doubt would be 4e-4";
}

TEST(Replay, SweepsThatChangeTheVelocityByMoreThanItsSigmaShowHowMuchOfTheAliasedNoiseStays) {
  Replay replay{EstimatorConfig{}};
  for (int i = 0; i <= 400; ++i) {
    ImuSample s = imu_at(milliseconds(5 * i));
    s.accel.x() += i % 2 == 0 ? 20 : -20;
    replay.add(s);
  }
  const auto added = [&replay] {
    Estimate e = start();
    e.t = begin_time + milliseconds(1990);
    e.P.setIdentity();
    e.P *= 1e-10;
    const double before = e.P(at::v, at::v);
    replay.predict_to(e, begin_time + milliseconds(2000), nullptr);
    return e.P(at::v, at::v) - before;
  };
  const double least = added();
  for (int sweep = 0; sweep < 100; ++sweep) replay.learn_accel_noise(1.0);
  EXPECT_EQ(added(), least) << "they are what the covariance says";
  for (int sweep = 0; sweep < 10; ++sweep) replay.learn_accel_noise(2.0);
  const double more = added();
  EXPECT_GT(more, 4 * least);
  for (int sweep = 0; sweep < 100; ++sweep) replay.learn_accel_noise(1e6);
  EXPECT_GT(added(), more);
  EXPECT_LT(added(), 40 * least) << "no sweep that fits nowhere makes the prediction worthless";
  for (int sweep = 0; sweep < 100; ++sweep) replay.learn_accel_noise(0.5);
  EXPECT_EQ(added(), least);
}

// Beyond its range an IMU missed what it missed, however its samples alias.
TEST(Replay, WhatClippingAddsDoesNotDependOnTheNoise) {
  const auto added = [](double aliased) {
    Replay replay{EstimatorConfig{}};
    for (int i = 0; i <= 400; ++i) {
      ImuSample s = imu_at(milliseconds(5 * i));
      s.accel.x() += i % 2 == 0 ? aliased : -aliased;
      s.accel_clipped = i == 400;
      replay.add(s);
    }
    Estimate e = start();
    e.t = begin_time + milliseconds(1995);
    e.P.setIdentity();
    e.P *= 1e-10;
    replay.predict_to(e, begin_time + milliseconds(2000), nullptr);
    return std::sqrt(e.P(at::v, at::v));
  };
  EXPECT_NEAR(added(0), 20 * std::sqrt(0.01 * 0.005), 1e-3);
  EXPECT_NEAR(added(20), added(0), 0.02);
}

TEST(Replay, AnIntervalThatIsClosedLaterIsAsIfBothEndsHadBeenKnown) {
  EstimatorConfig config;
  Replay replay(config);
  replay.add(imu_at({}));
  const Time next = begin_time + milliseconds(5);
  const Estimate held = advanced(replay, start(), next);
  replay.add(imu_at(milliseconds(5)));
  const Estimate closed = advanced(replay, start(), next);
  expect_same(closed,
              test::predict(start(), ImuInterval::between(imu_at({}), imu_at(milliseconds(5)), begin_time, next), {}, config.noise));
  EXPECT_GT(boxminus(held.x, closed.x).norm(), 1e-6);
}

TEST(Replay, AStepIsAppliedOnceHoweverOftenItsTimeIsReached) {
  const Replay replay = recorded(milliseconds(50));
  for (const int at_ms : {20, 23}) {
    const Time t = begin_time + milliseconds(at_ms);
    const Estimate once = advanced(replay, start(), t);
    expect_same(advanced(replay, once, t), once);
    Estimate before = advanced(replay, start(), t - milliseconds(1));
    replay.predict_to(before, t, nullptr);
    EXPECT_GT((before.P - once.P).norm(), 0) << "the step of that time is in it";
    EXPECT_NE(Replay(replay).take(before, leg_at(milliseconds(at_ms))), (std::array<bool, 2>{}));
    expect_same(before, once);
  }
}

// Legs as they come, with the newest IMU sample held, until the next one of these times, ms; then that comes. Closed as the estimator does
// it, and gone again as a whole.
struct BothWays {
  Estimate closed, again, live;
};
BothWays both_ways(int from, int until, int legs_until) {
  Replay replay = recorded(milliseconds(from));
  BothWays out;
  out.closed = out.live = advanced(replay, start(), begin_time + milliseconds(from));
  for (int ms = from + 1; ms < legs_until; ++ms) {
    replay.predict_to(out.live, begin_time + milliseconds(ms), nullptr);
    replay.take(out.live, leg_at(milliseconds(ms)));
  }
  replay.add(imu_at(milliseconds(until)));
  out.again = advanced(replay, out.closed, begin_time + milliseconds(until));
  replay.close(out.closed, out.live, begin_time + milliseconds(until), nullptr);
  return out;
}

TEST(Replay, ClosedByTheGainsOfThenItIsAsIfAllHadBeenDoneAgain) {
  for (const int from : {20, 95, 300}) {  // 100: the right foot comes down, 300: it has left
    const BothWays way = both_ways(from, from + 5, from + 5);
    EXPECT_EQ(way.closed.t, way.again.t);
    EXPECT_NE(way.closed.P, way.again.P) << "it was done again";
    const double difference = boxminus(way.closed.x, way.again.x).norm(), closing = boxminus(way.live.x, way.again.x).norm();
    // These feet slide by many sigmas, so that their rows are not linear; the gains of then are nearer than no closing.
    EXPECT_LT(difference, closing) << from;
    EXPECT_LT((way.closed.P - way.again.P).norm(), 0.03 * way.again.P.norm());
  }
}

TEST(Replay, ClosedOverAGapOfTheImuItIsDoneAgainWithTheNoiseOfTheGap) {
  const BothWays way = both_ways(20, 31, 31);
  EXPECT_EQ(way.closed.P, way.again.P);
  EXPECT_EQ(way.closed.x.v, way.again.x.v);
  EXPECT_EQ(way.closed.x.R.matrix(), way.again.x.R.matrix());
}

TEST(Replay, ClosedWhileTheLegsAreAheadItEndsAtTheSample) {
  const BothWays way = both_ways(20, 25, 28);
  EXPECT_EQ(way.closed.t, begin_time + milliseconds(25));
  EXPECT_EQ(way.closed.P, way.again.P);
}

TEST(Replay, StepsBetweenTheSamplesTakeEffectAtTheirOwnTime) {
  const Replay replay = recorded(milliseconds(120), microseconds(300));
  const Time step = begin_time + milliseconds(100) + microseconds(300);
  EXPECT_TRUE((advanced(replay, start(), step - Duration(1)).P.middleRows<3>(at::pcr).isZero(0)));
  EXPECT_FALSE((advanced(replay, start(), step).P.middleRows<3>(at::pcr).isZero(0)));
}

TEST(Replay, AFootThatHasLeftIsNoLongerPartOfTheState) {
  const Replay replay = recorded(milliseconds(350));
  EXPECT_GT(advanced(replay, start(), begin_time + milliseconds(299)).P(at::pcr, at::pcr), 0);
  const Estimate after = advanced(replay, start(), begin_time + milliseconds(350));
  EXPECT_TRUE((after.P.middleRows<3>(at::pcr).isZero(0)));
  EXPECT_GT(after.P(at::pcl, at::pcl), 0);
}

TEST(Replay, WhatIsForgottenIsNotNeeded) {
  const Replay all = recorded(milliseconds(400), microseconds(300));
  const Time end = begin_time + milliseconds(410);
  for (const Duration since : {microseconds(0), microseconds(300), microseconds(100'000), microseconds(152'300), microseconds(153'999),
                               microseconds(398'000), microseconds(400'000), microseconds(400'300), microseconds(405'000)}) {
    SCOPED_TRACE(to_seconds(since));
    const Estimate e = advanced(all, start(), begin_time + since);
    Replay rest = all;
    rest.forget_before(e.t);
    expect_same(advanced(rest, e, end), advanced(all, e, end));
  }
}

TEST(Replay, AllStatesOnTheWayAreRecorded) {
  const Replay replay = recorded(milliseconds(100));
  Trajectory record(std::chrono::seconds(2));
  Estimate e = start();
  record.push(e.t, e.x.pose(), e.x.v);
  replay.advance(e, begin_time + milliseconds(100), &record);
  EXPECT_EQ(record.size(), 101u);
  EXPECT_EQ(record.newest(), e.t);
  EXPECT_LT((record.at(e.t)->p - e.x.p).norm(), 1e-15) << "after the step, not before it";
}

TEST(Replay, AcrossAGapOfTheImuTheCovarianceSaysThatNobodyLooked) {
  const auto after_gap = [](Duration gap) {
    EstimatorConfig config;
    Replay replay(config);
    for (Duration t{}; t <= milliseconds(200); t += milliseconds(5)) replay.add(imu_at(t));
    replay.add(imu_at(milliseconds(200) + gap));
    Estimate e = start();
    e.P *= 1e-6;
    Trajectory record(std::chrono::seconds(2));
    replay.advance(e, begin_time + milliseconds(200) + gap, &record);
    return e.P.block<3, 3>(at::v, at::v).trace();
  };
  EXPECT_GT(after_gap(milliseconds(40)), 20 * after_gap(milliseconds(20)));
  EXPECT_GT(after_gap(milliseconds(500)), after_gap(milliseconds(120)));
}

TEST(Replay, ARobotThatTurnsGoesOnTurningAcrossAGapOfTheImuAndLeansNoFarther) {
  constexpr double rate = 0.8;  // rad/s
  const auto turned_over = [](Duration gap, double after) {
    Replay replay{EstimatorConfig{}};
    const auto sample = [](Duration t, double turning) {
      const double s = to_seconds(t);
      return ImuSample{begin_time + t, {0.5 * std::sin(12 * s), 0.5 * std::cos(12 * s), turning}, {0, 0, standard_gravity}};
    };
    for (Duration t{}; t <= std::chrono::seconds(4); t += milliseconds(5)) replay.add(sample(t, rate));
    const Time begin = begin_time + std::chrono::seconds(4);
    replay.add(sample(begin + gap - begin_time, after));
    Estimate e = start();
    e.t = begin;
    e.x.R = {};
    Trajectory record(std::chrono::seconds(2));
    replay.advance(e, begin + gap, &record);
    return Eigen::Vector3d(e.x.R.Log());
  };
  for (const int ms : {300, 600}) {
    const Eigen::Vector3d turned = turned_over(milliseconds(ms), rate);
    EXPECT_NEAR(turned.z(), rate * 1e-3 * ms, 0.15 * rate * 1e-3 * ms) << ms;
    EXPECT_LT(turned.head<2>().norm(), 0.01) << ms;
  }
  const double stopped = turned_over(milliseconds(600), 0).z();
  EXPECT_GT(stopped, 0.2 * rate * 0.6);
  EXPECT_LT(stopped, 0.8 * rate * 0.6) << "it turns no more";
}

// A sweep whose points were taken along while the IMU was silent is as uncertain as the prediction over that time.
TEST(Replay, WithinAGapTheNoiseIsThatOfThePredictionOverIt) {
  Replay replay{EstimatorConfig{}};
  for (Duration t{}; t <= milliseconds(400); t += milliseconds(5)) {
    if (t <= milliseconds(200) || t >= milliseconds(280)) replay.add(imu_at(t));
  }
  const auto gyro_within = [&](int from, int to) {
    return replay.noise_within(begin_time + milliseconds(from), begin_time + milliseconds(to)).gyro;
  };
  EXPECT_EQ(gyro_within(100, 200), ProcessNoise{}.gyro);
  EXPECT_EQ(gyro_within(250, 250), ProcessNoise{}.gyro);  // a sweep whose points were measured at once
  EXPECT_EQ(gyro_within(280, 380), ProcessNoise{}.gyro);
  Estimate e = start();
  e.t = begin_time + milliseconds(190);
  e.P.setZero();
  replay.predict_to(e, begin_time + milliseconds(290), nullptr);
  const double grown = e.P.block<3, 3>(at::R, at::R).trace() / 3, within = gyro_within(190, 290);
  EXPECT_GT(grown, 100 * 0.1 * ProcessNoise{}.gyro * ProcessNoise{}.gyro);
  EXPECT_NEAR(0.1 * within * within / grown, 1, 0.03);
}

// A robot at rest, whose biases are the means of what an IMU with noise said: at the end of that time it has neither turned nor got under
// way, whatever the noise was, and its covariance says so. From then on it grows.
TEST(Replay, WhileTheBiasesWereTakenNoiseAddsNothing) {
  test::Random random(5);
  std::vector<ImuSample> samples;
  Estimate e;
  e.t = begin_time;
  constexpr int n = 100;
  for (int i = 0; i <= n; ++i) {
    samples.push_back({begin_time + i * milliseconds(5), random.vector3(0.002), random.vector3(0.1) - e.x.g});
    const double weight = (i == 0 || i == n ? 0.5 : 1.0) / n;  // as they are integrated
    e.x.bg += weight * samples.back().gyro;
    e.x.ba += weight * (samples.back().accel + e.x.g);
  }
  e.P.diagonal().setConstant(1e-10);
  e.P.diagonal().segment<6>(at::bg).setConstant(1e-4);
  for (std::size_t side = 0; side < 2; ++side) end_stance(e, side);
  Replay replay{EstimatorConfig{}};
  for (const ImuSample& s : samples) replay.add(s);
  replay.began_at_rest(samples.back().t);
  replay.predict_to(e, samples.back().t, nullptr);
  EXPECT_LT(e.x.R.Log().norm(), 1e-4);
  EXPECT_LT(e.x.v.norm(), 1e-3);
  EXPECT_LT(e.P(at::R, at::R), 2e-10);
  EXPECT_LT(e.P(at::v, at::v), 2e-8);
  EXPECT_LT(std::abs(e.P(at::v, at::ba)), 1e-12);
  replay.predict_to(e, samples.back().t + milliseconds(20), nullptr);
  EXPECT_GT(e.P(at::R, at::R), 3e-8);
  EXPECT_LT(e.P(at::v, at::ba), -1e-6);
}

TEST(Replay, StampsThatJitterAreNoMissedSamples) {
  const auto after = [](Duration jitter, Duration beside) {
    Replay replay{EstimatorConfig{}};
    for (int i = 0; i <= 40; ++i) {
      ImuSample s = imu_at(i * milliseconds(5));
      s.accel.x() += i % 2 == 0 ? 5 : -5;
      s.t += i % 3 == 0 ? jitter : -jitter;
      replay.add(s);
      s.t += beside;
      if (beside > Duration(0) && i == 10) replay.add(s);
    }
    Estimate e = start();
    e.P *= 1e-6;
    Trajectory record(std::chrono::seconds(2));
    replay.advance(e, begin_time + milliseconds(195), &record);
    return std::sqrt(e.P.block<3, 3>(at::v, at::v).trace());
  };
  const double steady = after({}, {});
  EXPECT_NEAR(after(microseconds(500), {}), steady, 0.05 * steady);
  EXPECT_NEAR(after({}, microseconds(10)), steady, 0.05 * steady);
}

TEST(Replay, AMissedSampleMakesTheVelocityAsUncertainAsTheSignalIsRough) {
  const auto after = [](double roughness, bool missed) {
    Replay replay{EstimatorConfig{}};
    for (int i = 0; i <= 40; ++i) {
      ImuSample s = imu_at(i * milliseconds(5));
      s.accel.x() += i % 2 == 0 ? roughness : -roughness;
      if (!missed || i != 39) replay.add(s);
    }
    Estimate e = start();
    e.P *= 1e-6;
    Trajectory record(std::chrono::seconds(2));
    replay.advance(e, begin_time + milliseconds(190), &record);
    const double before = e.P.block<3, 3>(at::v, at::v).trace();
    replay.advance(e, begin_time + milliseconds(200), &record);
    return std::sqrt(e.P.block<3, 3>(at::v, at::v).trace() - before);
  };
  EXPECT_LT(after(5, false), 0.001);
  // Twice the amplitude beside the line, at one of three axes, for one sample.
  EXPECT_NEAR(after(5, true), 2 * 5 * 0.005, 0.002);
  EXPECT_LT(after(0.1, true), 0.004);
}

}  // namespace replay_test
}  // namespace kilvo
