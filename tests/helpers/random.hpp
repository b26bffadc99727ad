// Random values for tests, the same in every run.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <random>

#include "kilvo/math/so3.hpp"

namespace kilvo::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double normal(double sigma = 1) { return sigma * normal_(engine_); }
  double uniform(double low, double high) { return low + (high - low) * uniform_(engine_); }

  template <int N>
  Eigen::Matrix<double, N, 1> vector(double sigma = 1) {
    return Eigen::Matrix<double, N, 1>::NullaryExpr([&] { return normal(sigma); });
  }
  Eigen::Vector3d vector3(double sigma = 1) { return vector<3>(sigma); }
  Eigen::Vector3d direction() { return vector3().normalized(); }
  /// Any rotation, by an angle up to pi.
  SO3 rotation() { return SO3::Exp(uniform(0, std::numbers::pi) * direction()); }

  /// A covariance with correlations between everything, standard deviations around `sigma`.
  template <int N>
  Eigen::Matrix<double, N, N> covariance(double sigma) {
    const Eigen::Matrix<double, N, N> a = Eigen::Matrix<double, N, N>::NullaryExpr([&] { return normal(); });
    return sigma * sigma * (a * a.transpose() / N + 0.1 * Eigen::Matrix<double, N, N>::Identity());
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace kilvo::test
