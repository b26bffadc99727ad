#include "lab/doctor/robust_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace kilvo::lab {
namespace {

double squared_length(const Residuals& r, std::size_t group) {
  const auto width = static_cast<std::size_t>(r.width);
  double sum = 0;
  for (std::size_t i = 0; i < width; ++i) sum += r.r[group * width + i] * r.r[group * width + i];
  return sum;
}

// Information and gradient.
struct Normal {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  explicit Normal(Eigen::Index n) : H(Eigen::MatrixXd::Zero(n, n)), g(Eigen::VectorXd::Zero(n)) {}
};

// By block.
std::vector<Normal> sum_up(const Residuals& at, const std::vector<Residuals>& moved, const Eigen::VectorXd& step, double scale) {
  const auto n = step.size();
  const auto width = static_cast<std::size_t>(at.width);
  std::vector<Normal> out;
  Eigen::VectorXd J(n);
  for (std::size_t k = 0; k < at.groups(); ++k) {
    if (k == 0 || at.block[k] != at.block[k - 1]) out.emplace_back(n);
    const double weight = 1 / (1 + squared_length(at, k) / (static_cast<double>(width) * 4 * scale * scale));
    for (std::size_t i = k * width; i < (k + 1) * width; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) J[j] = (moved[static_cast<std::size_t>(j)].r[i] - at.r[i]) / step[j];
      out.back().H.selfadjointView<Eigen::Lower>().rankUpdate(J, weight);
      out.back().g += weight * at.r[i] * J;
    }
  }
  for (Normal& block : out) block.H.triangularView<Eigen::StrictlyUpper>() = block.H.transpose();
  return out;
}

}  // namespace

double Fit::sigma(int i) const { return good ? std::sqrt(std::max(cov(i, i), 0.0)) : INFINITY; }

double scale_of(const Residuals& r) {
  if (r.groups() == 0) return 0;
  std::vector<double> lengths(r.groups());
  for (std::size_t k = 0; k < r.groups(); ++k) lengths[k] = squared_length(r, k);
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::ranges::nth_element(lengths, middle);
  // Median of chi-square with as many degrees of freedom: 0.45, 1.39, 2.37, about n - 2/3.
  constexpr double medians[] = {0.455, 1.386, 2.366};
  return std::sqrt(*middle / (r.width <= 3 ? medians[r.width - 1] : r.width - 0.67)) + 1e-12;
}

double cost_of(const Residuals& r, double scale) {
  double sum = 0;
  for (std::size_t k = 0; k < r.groups(); ++k) sum += std::log1p(squared_length(r, k) / (r.width * scale * scale));
  return r.groups() == 0 ? INFINITY : sum / static_cast<double>(r.groups());
}

Fit robust_fit(const ResidualFunction& residuals, const Eigen::VectorXd& start, const Eigen::VectorXd& prior_sigma,
               const Eigen::VectorXd& step, int iterations) {
  Fit out;
  out.x = start;
  const auto n = start.size();
  const Eigen::VectorXd prior = prior_sigma.array().square().inverse();
  Residuals at;
  std::vector<Residuals> moved(static_cast<std::size_t>(n));
  for (int k = 0; k <= iterations; ++k) {
    at.clear();
    residuals(out.x, at);
    if (at.groups() < static_cast<std::size_t>(5 * n)) return out;
    out.scale = scale_of(at);
    for (Eigen::Index j = 0; j < n; ++j) {
      Eigen::VectorXd x = out.x;
      x[j] += step[j];
      Residuals& there = moved[static_cast<std::size_t>(j)];
      there.clear();
      residuals(x, there);
      if (there.groups() != at.groups()) return out;
    }
    const std::vector<Normal> blocks = sum_up(at, moved, step, out.scale);
    const double s2 = out.scale * out.scale;
    Eigen::MatrixXd H = (s2 * prior).asDiagonal();
    Eigen::VectorXd g = s2 * prior.cwiseProduct(out.x - start);
    for (const Normal& b : blocks) H += b.H, g += b.g;
    const Eigen::MatrixXd inverse = H.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
    if (k == iterations) {
      const Eigen::MatrixXd prior_meat = s2 * s2 * Eigen::MatrixXd(prior.asDiagonal());
      out.cov = inverse * prior_meat * inverse + jackknife(blocks, H);
      out.good = out.x.allFinite() && out.cov.allFinite();
      break;
    }
    const Eigen::VectorXd dx = -inverse * g;
    if (!dx.allFinite()) return out;
    out.x += dx;
    if ((dx.array().abs() < 1e-3 * step.array()).all()) k = iterations - 1;
  }
  out.groups = at.groups();
  out.cost = cost_of(at, out.scale);
  return out;
}

}  // namespace kilvo::lab
