#include "lab/doctor/mount_regression.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "kilvo/filter/predict.hpp"
#include "kilvo/filter/update.hpp"

namespace kilvo::lab {
namespace mount_regression_test {

using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double imu_period = 0.005, sweep_period = 0.1;  // s
constexpr double turn_noise = 2e-4, place_noise = 3e-4;   // rad, m, of a sweep
constexpr double gyro_noise = 2e-5, accel_noise = 2e-3;   // rad/s, m/s^2, of a sample
const SE3 described(SO3::Exp({0.1, -0.2, 0.3}), {-0.01, -0.02, 0.04});

Eigen::Vector3d attitude(double t) { return {0.04 * std::sin(7 * t), 0.05 * std::sin(9 * t + 1), 0.8 * std::sin(0.6 * t)}; }
SO3 turned(double t) {
  const Eigen::Vector3d a = attitude(t);
  return SO3::Exp({0, 0, a.z()}) * SO3::Exp({a.x(), a.y(), 0});
}
Eigen::Vector3d place(double t) { return {0.5 * std::sin(0.5 * t), 0.02 * std::sin(7 * t), 0.02 * std::sin(14 * t)}; }

/// What an IMU measures between two samples of the motion, which are so near that differences are derivatives.
ImuSample imu_at(double t, const Eigen::Matrix3d& accel_axes) {
  constexpr double h = 1e-4;
  ImuSample s;
  s.t = Time{from_seconds(t)};
  s.gyro = (turned(t - h).inverse() * turned(t + h)).Log() / (2 * h);
  const Eigen::Vector3d acceleration = (place(t + h) - 2 * place(t) + place(t - h)) / (h * h);
  s.accel = accel_axes * (turned(t).inverse() * (acceleration + Eigen::Vector3d(0, 0, standard_gravity)));
  return s;
}

/// A walk of `seconds` with a LiDAR that is mounted at Exp(error) of what is described: a filter that believes the description, and the
/// regression of its innovations.
std::optional<MountMeasurement> measured(const Vector6& error, const Eigen::Matrix3d& accel_axes, std::uint32_t seed, double seconds = 60) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto noise = [&](double sigma) { return Eigen::Vector3d(sigma * Eigen::Vector3d(normal(random), normal(random), normal(random))); };
  const SE3 mount(SO3::Exp(error.head<3>()) * described.R, described.p + error.tail<3>());
  const auto pose = [](double t) { return SE3(turned(t), place(t)); };
  // A map of the LiDAR's own poses that begins with the described mount.
  const SE3 to_map = pose(0) * described * (pose(0) * mount).inverse();
  ProcessNoise process;
  process.gyro = 2 * gyro_noise * std::sqrt(imu_period);
  process.accel = 2 * accel_noise * std::sqrt(imu_period);
  process.velocity = 0;
  Estimate e;
  e.t = Time{from_seconds(0)};
  e.x.R = turned(0);
  e.x.p = place(0);
  e.x.v = (place(1e-4) - place(-1e-4)) / 2e-4;
  for (int k = 0; k < at::pcl; ++k) e.P(k, k) = k < at::p ? 1e-6 : k < at::v ? 1e-8 : k < at::bg ? 1e-4 : k < at::ba ? 1e-8 : 1e-3;
  e.P(at::g + 2, at::g + 2) = 0;  // gravity's length is known
  MountRegression regression(described);
  std::vector<ImuSample> samples{imu_at(0, accel_axes)};
  for (double t = sweep_period; t < seconds; t += sweep_period) {
    const Estimate from = e;
    samples.erase(samples.begin(), samples.end() - 1);
    for (int i = 1; i <= std::lround(sweep_period / imu_period); ++i) {
      ImuSample s = imu_at(t - sweep_period + i * imu_period, accel_axes);
      s.gyro += noise(gyro_noise);
      s.accel += noise(accel_noise);
      carry(e, ImuInterval::between(samples.back(), s, e.t, s.t), {}, process);
      samples.push_back(s);
    }
    const Estimate prior = e;
    const SE3 truth = to_map * pose(t) * mount * described.inverse();
    const SE3 seen(truth.R * SO3::Exp(noise(turn_noise)), truth.p + noise(place_noise));
    const auto model = [&](const State& x, const Covariance&) {
      Information<6> info;
      info.columns = {0, 1, 2, 3, 4, 5};
      info.A.diagonal() << Eigen::Vector3d::Constant(1 / (turn_noise * turn_noise)),
          Eigen::Vector3d::Constant(1 / (place_noise * place_noise));
      State z = x;
      z.R = seen.R;
      z.p = seen.p;
      info.b = info.A * boxminus(x, z).head<6>();
      return info;
    };
    e = update(prior, model, {}).posterior;
    regression.add(from, prior, e, samples);
  }
  return regression.measured();
}

Vector6 off_by(const Eigen::Vector3d& degrees, const Eigen::Vector3d& millimetres) {
  Vector6 out;
  out << M_PI / 180 * degrees, 1e-3 * millimetres;
  return out;
}

TEST(MountRegression, MeasuresTurnAndShift) {
  const Vector6 wrong = off_by({0.4, -0.3, 0.2}, {5, -4, 6});
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const auto m = measured(wrong, Eigen::Matrix3d::Identity(), seed);
    ASSERT_TRUE(m);
    const Vector6 sigma = m->covariance.diagonal().cwiseSqrt(), off = m->error - wrong;
    EXPECT_LT(off.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 3) << seed;
    EXPECT_LT(off.tail<3>().norm(), 0.005) << seed;
    const auto shift = expected_shift(*m, Eigen::Vector3d::Zero());
    ASSERT_TRUE(shift) << seed;
    EXPECT_LT((*shift - wrong.tail<3>()).norm(), 0.5 * wrong.tail<3>().norm()) << seed;
  }
}

TEST(MountRegression, IsRightOnAverage) {
  const Vector6 wrong = off_by({0.4, -0.3, 0.2}, {5, -4, 6});
  constexpr int walks = 8;
  Vector6 off = Vector6::Zero(), variance = Vector6::Zero();
  for (std::uint32_t seed = 1; seed <= walks; ++seed) {
    const auto m = measured(wrong, Eigen::Matrix3d::Identity(), seed);
    ASSERT_TRUE(m);
    off += (m->error - wrong) / walks;
    variance += m->covariance.diagonal() / (walks * walks);
  }
  EXPECT_LT(off.cwiseQuotient(variance.cwiseSqrt()).cwiseAbs().maxCoeff(), 3);
  EXPECT_LT(off.tail<3>().norm(), 0.001);
}

TEST(MountRegression, IsNotMisledByTheAxesOfTheAccelerometer) {
  Eigen::Matrix3d axes;
  axes << 1.005, 0.004, -0.003, 0.002, 0.995, 0.005, -0.004, 0.003, 1.004;
  const Vector6 wrong = off_by({0.2, 0.2, -0.3}, {-5, 3, 4});
  const auto m = measured(wrong, axes, 4);
  ASSERT_TRUE(m);
  const Vector6 sigma = m->covariance.diagonal().cwiseSqrt();
  EXPECT_LT((m->error - wrong).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 3);
}

TEST(MountRegression, ExpectsNothingOfAMountThatIsAsDescribed) {
  for (std::uint32_t seed = 5; seed <= 8; ++seed) {
    const auto m = measured(Vector6::Zero(), Eigen::Matrix3d::Identity(), seed);
    ASSERT_TRUE(m);
    EXPECT_LT(m->error.cwiseQuotient(m->covariance.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff(), 3) << seed;
    EXPECT_FALSE(expected_shift(*m, Eigen::Vector3d::Zero())) << seed;
  }
}

TEST(MountRegression, ATurnThatWasFoundBeforeSaysHowTheMountWasDescribed) {
  MountMeasurement m;
  m.error << 0, 0, 0, 0.003, -0.003, 0.004;
  m.covariance = PoseCovariance::Zero();
  m.covariance.diagonal() << Eigen::Vector3d::Constant(4e-6), Eigen::Vector3d::Constant(6e-6);
  const auto alone = expected_shift(m, Eigen::Vector3d::Zero()), turned = expected_shift(m, {0.006, -0.005, 0.007});
  ASSERT_TRUE(turned);
  EXPECT_GT(turned->norm(), 0.7 * m.error.tail<3>().norm());
  EXPECT_LT(alone.value_or(Eigen::Vector3d::Zero()).norm(), turned->norm());
  // It has been corrected: what it has in common with the shift is none of what the shift is.
  m.covariance.block<3, 3>(0, 3).diagonal().setConstant(2e-6);
  m.covariance.block<3, 3>(3, 0).diagonal().setConstant(2e-6);
  const auto in_common = expected_shift(m, {0.02, -0.02, 0.03});
  ASSERT_TRUE(in_common);
  EXPECT_LT((*in_common - m.error.tail<3>()).norm(), 0.3 * m.error.tail<3>().norm());
  // Another convention says nothing.
  EXPECT_EQ(expected_shift(m, {M_PI, 0, 0}).value_or(Eigen::Vector3d::Zero()),
            expected_shift(m, Eigen::Vector3d::Zero()).value_or(Eigen::Vector3d::Zero()));
}

TEST(MountRegression, TakesTheMoreTheLargerItIsUntilNoDescriptionIsThatWrong) {
  MountMeasurement m;
  m.error.setZero();
  m.covariance = PoseCovariance::Zero();
  m.covariance.diagonal().setConstant(2e-6);
  double taken = 0;
  for (const double shift : {0.007, 0.01, 0.015, 0.019}) {
    m.error[3] = shift;
    const auto expected = expected_shift(m, Eigen::Vector3d::Zero());
    ASSERT_TRUE(expected) << shift;
    EXPECT_GT(expected->x(), std::max(taken, 0.5 * shift)) << shift;
    taken = expected->x();
  }
  m.error.tail<3>() << -0.033, 0.008, 0.002;
  m.covariance.diagonal().setConstant(2.5e-5);
  EXPECT_FALSE(expected_shift(m, Eigen::Vector3d::Zero()));
}

TEST(MountRegression, SaysNothingOfAFewSecondsOrOfSweepsThatDoNotFollowEachOther) {
  EXPECT_FALSE(measured(Vector6::Zero(), Eigen::Matrix3d::Identity(), 1, 8));
  MountRegression regression(described);
  Estimate e;
  e.P.diagonal().setConstant(1e-6);
  for (int i = 0; i < 400; ++i) {
    const Time t{from_seconds(0.1 * i)};
    Estimate from = e, prior = e;
    from.t = t;
    from.x.p.x() = i;  // each from another place than the one before led to
    prior.t = t + from_seconds(0.1);
    ImuSample a, b;
    a.t = from.t;
    b.t = prior.t;
    regression.add(from, prior, prior, std::vector<ImuSample>{a, b});
  }
  EXPECT_FALSE(regression.measured());
}

}  // namespace mount_regression_test
}  // namespace kilvo::lab
