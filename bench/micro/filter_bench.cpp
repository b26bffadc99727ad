// The filter: one prediction, one update, and the inverse that everything is compared with.
#include <Eigen/LU>
#include <benchmark/benchmark.h>
#include <random>

#include "kilvo/filter/predict.hpp"
#include "kilvo/filter/update.hpp"

namespace kilvo {
namespace {

template <int N>
Eigen::Matrix<double, N, N> random_covariance(unsigned seed, double scale) {
  std::mt19937 random(seed);
  std::normal_distribution<double> n;
  const Eigen::Matrix<double, N, N> A = Eigen::Matrix<double, N, N>::NullaryExpr([&] { return n(random); });
  return scale * (A * A.transpose() + Eigen::Matrix<double, N, N>::Identity());
}

Estimate some_estimate() {
  Estimate e;
  e.x.R = SO3::Exp({0.1, -0.2, 0.7});
  e.x.p = {1, 2, 0.5};
  e.x.v = {0.6, 0.1, -0.05};
  e.P = random_covariance<at::size>(1, 1e-6);
  return e;
}

// Six rows over the pose, as a model of the form r = r0 + H d about the prior.
struct LinearModel {
  Eigen::Matrix<double, 6, 6> J = random_covariance<6>(2, 1.0), R = random_covariance<6>(3, 1e-4);
  Eigen::Matrix<double, 6, 1> r0 = 0.002 * Eigen::Matrix<double, 6, 1>::Ones();
  State prior;

  Eigen::Matrix<double, 6, 1> residual(const State& x) const { return r0 + J * boxminus(x, prior).head<6>(); }
};

void inverse_25x25(benchmark::State& state) {
  const Covariance P = random_covariance<at::size>(4, 1.0);
  for (auto _ : state) {
    Covariance inverse = P.inverse();
    benchmark::DoNotOptimize(inverse);
  }
}
BENCHMARK(inverse_25x25);

void predict_one_interval(benchmark::State& state) {
  const Estimate e = some_estimate();
  ImuInterval interval;
  interval.begin = e.t;
  interval.end = e.t + std::chrono::milliseconds(5);
  interval.gyro_begin = {0.1, 0.2, -0.1};
  interval.gyro_end = {0.12, 0.17, -0.11};
  interval.accel_begin = {0.3, 0.1, 9.7};
  interval.accel_end = {0.2, 0.15, 9.9};
  const StandingFeet standing{true, true};
  for (auto _ : state) {
    Estimate out = e;
    carry(out, interval, standing, {});
    benchmark::DoNotOptimize(out);
  }
}
BENCHMARK(predict_one_interval);

void update_with_rows(benchmark::State& state, int iterations) {
  const Estimate e = some_estimate();
  LinearModel linear;
  linear.prior = e.x;
  Rows<6> rows;
  rows.H.setZero(6, at::size);
  rows.H.leftCols<6>() = linear.J;
  rows.R = linear.R;
  UpdateConfig config;
  config.max_iterations = iterations;
  for (auto _ : state) {
    Update out = update(
        e,
        [&](const State& x, const Covariance&) -> const Rows<6>& {
          rows.r = linear.residual(x);
          return rows;
        },
        config);
    benchmark::DoNotOptimize(out);
  }
}

void update_6_rows(benchmark::State& state) { update_with_rows(state, 1); }
void update_6_rows_to_convergence(benchmark::State& state) { update_with_rows(state, UpdateConfig{}.max_iterations); }
BENCHMARK(update_6_rows);
BENCHMARK(update_6_rows_to_convergence);

void update_information_6(benchmark::State& state) {
  const Estimate e = some_estimate();
  LinearModel linear;
  linear.prior = e.x;
  const Eigen::Matrix<double, 6, 6> weight = linear.R.inverse();
  Information<6> info;
  info.columns = {0, 1, 2, 3, 4, 5};
  info.A = linear.J.transpose() * weight * linear.J;
  info.rows = 6;
  UpdateConfig config;
  config.max_iterations = 1;
  const Eigen::Matrix<double, 6, 6> JtW = linear.J.transpose() * weight;
  for (auto _ : state) {
    Update out = update(
        e,
        [&](const State& x, const Covariance&) -> const Information<6>& {
          info.b = JtW * linear.residual(x);
          return info;
        },
        config);
    benchmark::DoNotOptimize(out);
  }
}
BENCHMARK(update_information_6);

}  // namespace
}  // namespace kilvo
