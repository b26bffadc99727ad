#include "kilvo/filter/predict.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/predict.hpp"
#include "tests/helpers/random_state.hpp"

namespace kilvo {
namespace predict_test {

const Time begin_time = time_from_ns(1'700'000'000'000'000'000);

ImuInterval random_interval(test::Random& random, double dt) {
  const Eigen::Vector3d gyro = random.vector3(2), accel = random.vector3(10);
  return {begin_time, begin_time + from_seconds(dt), gyro, gyro + random.vector3(0.5), accel, accel + random.vector3(3)};
}

ProcessNoise no_noise() { return {0, 0, 0, 0, 0, 0, 0}; }

// The true motion under rate and specific force that are linear in time in the body: midpoint rule in `steps` steps.
State integrate_finely(State x, const ImuInterval& i, int steps) {
  const double dt = to_seconds(i.end - i.begin), h = dt / steps;
  for (int k = 0; k < steps; ++k) {
    const double s = (k + 0.5) / steps;
    const Eigen::Vector3d w = i.gyro_begin + s * (i.gyro_end - i.gyro_begin) - x.bg;
    const Eigen::Vector3d f = i.accel_begin + s * (i.accel_end - i.accel_begin) - x.ba;
    const Eigen::Vector3d a = x.R * (SO3::Exp(0.5 * h * w) * f) + x.g;
    x.p += h * x.v + 0.5 * h * h * a;
    x.v += h * a;
    x.R = x.R * SO3::Exp(h * w);
  }
  return x;
}

TEST(Predict, ConstantForceWithoutTurningIsExact) {
  test::Random random(1);
  for (int i = 0; i < 50; ++i) {
    const State x = test::random_state(random);
    const Eigen::Vector3d a = random.vector3(3);
    const Eigen::Vector3d force = x.R.inverse() * (a - x.g) + x.ba;
    const State y = predict_mean(x, {begin_time, begin_time + from_seconds(0.5), x.bg, x.bg, force, force});
    EXPECT_LT((y.p - (x.p + 0.5 * x.v + 0.125 * a)).norm(), 1e-13);
    EXPECT_LT((y.v - (x.v + 0.5 * a)).norm(), 1e-13);
    EXPECT_LT((y.R.matrix() - x.R.matrix()).norm(), 1e-14);
  }
}

TEST(Predict, ForceThatGrowsLinearlyIsExact) {
  const Eigen::Vector3d jerk(3, -2, 1), up(0, 0, standard_gravity);
  const double dt = 0.2;
  const State y = predict_mean(State{}, {begin_time, begin_time + from_seconds(dt), {0, 0, 0}, {0, 0, 0}, up, up + dt * jerk});
  EXPECT_LT((y.v - jerk * dt * dt / 2).norm(), 1e-14);
  EXPECT_LT((y.p - jerk * dt * dt * dt / 6).norm(), 1e-14);
}

TEST(Predict, TurningAtAConstantRateUnderAConstantForceOfTheWorldIsExact) {
  test::Random random(2);
  for (int i = 0; i < 50; ++i) {
    const State x = test::random_state(random);
    const Eigen::Vector3d rate = random.vector3(3), a = random.vector3(3);
    const double dt = 0.1;
    const SO3 turned = x.R * SO3::Exp(dt * rate);
    const State y = predict_mean(x, {begin_time, begin_time + from_seconds(dt), rate + x.bg, rate + x.bg, x.R.inverse() * (a - x.g) + x.ba,
                                     turned.inverse() * (a - x.g) + x.ba});
    EXPECT_LT((y.R.matrix() - turned.matrix()).norm(), 1e-13);
    EXPECT_LT((y.v - (x.v + dt * a)).norm(), 1e-13);
    EXPECT_LT((y.p - (x.p + dt * x.v + 0.5 * dt * dt * a)).norm(), 1e-13);
  }
}

TEST(Predict, WhatItNeglectsShrinksWithTheThirdPowerOfTheInterval) {
  test::Random random(3);
  for (int i = 0; i < 50; ++i) {
    const State x = test::random_state(random);
    const Eigen::Vector3d gyro = random.vector3(2), accel = random.vector3(10), gyro_rate = random.vector3(20),
                          accel_rate = random.vector3(100);
    const auto error_of = [&](double dt) {
      const ImuInterval interval{begin_time, begin_time + from_seconds(dt), gyro, gyro + dt * gyro_rate, accel, accel + dt * accel_rate};
      const ErrorVector e = boxminus(predict_mean(x, interval), integrate_finely(x, interval, 500));
      return Eigen::Vector3d(e.segment<3>(at::R).norm(), e.segment<3>(at::v).norm(), e.segment<3>(at::p).norm());
    };
    const Eigen::Vector3d at_200_hz = error_of(0.005), at_100_hz = error_of(0.01);
    // rad, m/s, m in one interval: gyro x gyro_rate / 12 dt^3, |rate|^2 |f| / 12 dt^3, that times dt / 2.
    EXPECT_LT(at_200_hz[0], 1.0 / 12 * gyro.norm() * gyro_rate.norm() * 1.25e-7 * 1.5 + 1e-9);
    EXPECT_LT(at_200_hz[1], 1.25e-7 * (gyro.norm() + 0.2) * ((gyro.norm() + 0.2) * (accel.norm() + 1) + 2 * accel_rate.norm() + 1));
    EXPECT_LT(at_200_hz[2], 0.005 * at_200_hz[1] + 1e-9);
    EXPECT_LT(at_200_hz[1], at_100_hz[1] / 6 + 1e-8);
  }
}

TEST(Predict, MeanAndEstimateAgreeAndNothingElseMoves) {
  test::Random random(4);
  for (int i = 0; i < 20; ++i) {
    const Estimate e{begin_time, test::random_state(random), random.covariance<at::size>(0.1)};
    const ImuInterval interval = random_interval(random, 0.005);
    const Estimate after = test::predict(e, interval, {}, {});
    EXPECT_EQ(after.t, interval.end);
    const State mean = predict_mean(e.x, interval);
    EXPECT_EQ(after.x.R.matrix(), mean.R.matrix());
    EXPECT_EQ(after.x.p, mean.p);
    EXPECT_EQ(after.x.v, mean.v);
    EXPECT_EQ(after.x.bg, e.x.bg);
    EXPECT_EQ(after.x.ba, e.x.ba);
    EXPECT_EQ(after.x.g, e.x.g);
    EXPECT_EQ(after.x.pc, e.x.pc);
    EXPECT_EQ(after.x.tau, e.x.tau);
  }
}

// F itself: predict maps P to F P F', so P = e_i e_tau' + e_tau e_i' shows column i in column tau of the result.
Covariance transition_of(const State& x, const ImuInterval& interval) {
  Covariance F = Covariance::Identity();
  for (int i = 0; i < at::tau; ++i) {
    Estimate e{begin_time, x, Covariance::Zero()};
    e.P(i, at::tau) = e.P(at::tau, i) = 1;
    F.col(i) = test::predict(e, interval, {}, no_noise()).P.col(at::tau);
  }
  return F;
}

TEST(Predict, TheTransitionIsTheDerivativeOfTheMeanAt200RandomStates) {
  test::Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const State x = test::random_state(random);
    const ImuInterval interval = random_interval(random, trial % 2 == 0 ? 0.005 : 0.1);
    const State y = predict_mean(x, interval);
    const Covariance F = transition_of(x, interval);
    const double h = 1e-5;
    for (int block = 0; block < at::size; block += 3) {
      const int width = block == at::tau ? 1 : 3;
      Eigen::Matrix<double, at::size, Eigen::Dynamic> numeric(+at::size, width), analytic(+at::size, width);
      for (int k = 0; k < width; ++k) {
        ErrorVector direction = ErrorVector::Unit(block + k);
        // Gravity turns, but does not grow.
        if (block == at::g) direction.segment<3>(at::g) -= x.g * x.g[k] / x.g.squaredNorm();
        const ErrorVector ahead = boxminus(predict_mean(boxplus(x, h * direction), interval), y);
        const ErrorVector behind = boxminus(predict_mean(boxplus(x, -h * direction), interval), y);
        numeric.col(k) = (ahead - behind) / (2 * h);
        analytic.col(k) = F * direction;
      }
      for (int row = 0; row < at::size; row += 3) {
        const int height = row == at::tau ? 1 : 3;
        const auto expected = numeric.middleRows(row, height), found = analytic.middleRows(row, height);
        // Relative to the block; rounding of positions of some metres over 2 h is 1e-10.
        EXPECT_LT((found - expected).norm(), 1e-6 * expected.norm() + 3e-10) << "rows " << row << " columns " << block;
      }
    }
  }
}

TEST(Predict, TheCovarianceIsTransportedByTheTransition) {
  test::Random random(6);
  for (int i = 0; i < 50; ++i) {
    const Estimate e{begin_time, test::random_state(random), random.covariance<at::size>(0.1)};
    const ImuInterval interval = random_interval(random, 0.05);
    const Covariance F = transition_of(e.x, interval);
    const Covariance expected = F * e.P * F.transpose();
    const Covariance found = test::predict(e, interval, {}, no_noise()).P;
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
    EXPECT_EQ(found, found.transpose());
  }
}

Estimate one_second(double rate, double more_gyro = 0, double more_accel = 0) {
  Estimate e;
  e.t = begin_time;
  const StandingFeet standing = {true, true};
  for (int i = 0; i < static_cast<int>(rate); ++i) {
    ImuInterval interval = ImuInterval::hold({e.t, {0.3, -0.2, 0.5}, {0.5, 1, 9.5}}, e.t, begin_time + from_seconds((i + 1) / rate));
    interval.more_gyro = more_gyro;
    interval.more_accel = more_accel;
    e = test::predict(e, interval, standing, {});
  }
  return e;
}

TEST(Predict, OneSettingOfNoiseIsOneFilterAtAnyRate) {
  const Covariance slow = one_second(200).P, fast = one_second(1000).P;
  for (int i = 0; i < at::size; ++i) {
    for (int j = 0; j < at::size; ++j) EXPECT_NEAR(slow(i, j), fast(i, j), 0.01 * std::sqrt(fast(i, i) * fast(j, j))) << i << " " << j;
  }
}

TEST(Predict, NoiseDensitiesMeanWhatTheirUnitsSay) {
  const ProcessNoise n;
  const Covariance P = one_second(200).P;
  const auto sigma = [&P](int i) { return std::sqrt(P(i, i)); };
  EXPECT_NEAR(sigma(at::bg), n.gyro_bias, 1e-6 * n.gyro_bias);
  EXPECT_NEAR(sigma(at::ba), n.accel_bias, 1e-6 * n.accel_bias);
  EXPECT_NEAR(sigma(at::tau), n.exposure, 1e-6 * n.exposure);
  EXPECT_NEAR(sigma(at::pcl), n.foot, 1e-6 * n.foot);
  EXPECT_NEAR(sigma(at::pcr + 2), n.foot_vertical, 1e-6 * n.foot_vertical);
  EXPECT_EQ(P(at::g, at::g), 0);
  // After 1 s, gyro^2 + gyro_bias^2 / 3.
  EXPECT_NEAR(sigma(at::R), std::sqrt(n.gyro * n.gyro + n.gyro_bias * n.gyro_bias / 3), 1e-3 * n.gyro);
}

TEST(Predict, WhatTheImuMissedIsAddedToTheNoiseOfTheImuOnly) {
  const ProcessNoise n;
  const Covariance P = one_second(200, 99 * n.gyro * n.gyro, 0.3 * 0.3).P, usual = one_second(200).P;
  EXPECT_NEAR(std::sqrt(P(at::R, at::R)), 10 * n.gyro, 1e-2 * n.gyro);
  EXPECT_NEAR(P(at::v, at::v) - usual(at::v, at::v), 0.3 * 0.3, 1e-3);
  EXPECT_NEAR(std::sqrt(P(at::ba, at::ba)), n.accel_bias, 1e-6 * n.accel_bias);
}

TEST(Predict, AFootThatDoesNotStandGetsNoNoise) {
  Estimate e;
  e.t = begin_time;
  const ImuInterval interval = ImuInterval::hold({e.t, {0, 0, 0}, {0, 0, 9.8}}, e.t, e.t + from_seconds(0.1));
  const Covariance P = test::predict(e, interval, {false, true}, {}).P;
  EXPECT_EQ(P(at::pcl, at::pcl), 0);
  EXPECT_NEAR(P(at::pcr, at::pcr), ProcessNoise{}.foot * ProcessNoise{}.foot * 0.1, 1e-12);
}

TEST(ImuInterval, BetweenTwoSamplesIsThePieceOfTheStraightLine) {
  const ImuSample a{begin_time, {0, 0, 1}, {1, 0, 0}}, b{begin_time + Duration(5'000'000), {0, 0, 2}, {1, 5, 0}};
  const ImuInterval i = ImuInterval::between(a, b, a.t + Duration(1'000'000), a.t + Duration(4'000'000));
  EXPECT_NEAR(i.gyro_begin.z(), 1.2, 1e-14);
  EXPECT_NEAR(i.gyro_end.z(), 1.8, 1e-14);
  EXPECT_NEAR(i.accel_begin.y(), 1, 1e-14);
  EXPECT_NEAR(i.accel_end.y(), 4, 1e-14);
  const ImuInterval nothing = ImuInterval::between(a, {a.t, b.gyro, b.accel}, a.t, a.t);
  EXPECT_EQ(nothing.gyro_begin, a.gyro);
  EXPECT_EQ(nothing.gyro_end, b.gyro);
}

TEST(Predict, AnEmptyIntervalChangesNothing) {
  test::Random random(7);
  const Estimate e{begin_time, test::random_state(random), random.covariance<at::size>(0.1)};
  const Estimate after = test::predict(e, random_interval(random, 0), {}, {});
  EXPECT_LT(boxminus(after.x, e.x).norm(), 1e-14);
  EXPECT_LT((after.P - e.P).norm(), 1e-15);
}

}  // namespace predict_test
}  // namespace kilvo
