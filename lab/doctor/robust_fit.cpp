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
};

// By block.
std::vector<Normal> sum_up(const Residuals& at, const Derivatives& J, double scale) {
  const auto width = static_cast<std::size_t>(at.width);
  Eigen::VectorXd weights(J.rows());
  for (std::size_t k = 0; k < at.groups(); ++k) {
    const double weight = 1 / (1 + squared_length(at, k) / (static_cast<double>(width) * 4 * scale * scale));
    weights.segment(static_cast<Eigen::Index>(k * width), at.width).setConstant(weight);
  }
  const Eigen::Map<const Eigen::VectorXd> r(at.r.data(), J.rows());
  std::vector<Normal> out;
  Derivatives weighted;
  for (std::size_t k = 0, next = 0; k < at.groups(); k = next) {
    while (next < at.groups() && at.block[next] == at.block[k]) ++next;
    const auto first = static_cast<Eigen::Index>(k * width), rows = static_cast<Eigen::Index>((next - k) * width);
    weighted = weights.segment(first, rows).asDiagonal() * J.middleRows(first, rows);
    out.push_back({weighted.transpose() * J.middleRows(first, rows), weighted.transpose() * r.segment(first, rows)});
  }
  return out;
}

// By differences; false when the rows are not the same there.
bool differentiate(const ResidualFunction& residuals, const Eigen::VectorXd& x, const Residuals& at, const Eigen::VectorXd& step,
                   Derivatives& J) {
  const Eigen::Map<const Eigen::VectorXd> r(at.r.data(), J.rows());
  Residuals there;
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    Eigen::VectorXd moved = x;
    moved[j] += step[j];
    there.clear();
    residuals(moved, there);
    if (there.groups() != at.groups()) return false;
    J.col(j) = (Eigen::Map<const Eigen::VectorXd>(there.r.data(), J.rows()) - r) / step[j];
  }
  return true;
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
               const Eigen::VectorXd& step, int iterations, const DerivativeFunction& derivative) {
  Fit out;
  out.x = start;
  const auto n = start.size();
  const Eigen::VectorXd prior = prior_sigma.array().square().inverse();
  Residuals at;
  Derivatives J;
  for (int k = 0; k <= iterations; ++k) {
    at.clear();
    residuals(out.x, at);
    if (at.groups() < static_cast<std::size_t>(5 * n)) return out;
    out.scale = scale_of(at);
    J.resize(static_cast<Eigen::Index>(at.r.size()), n);
    if (derivative) {
      derivative(out.x, J);
    } else if (!differentiate(residuals, out.x, at, step, J)) {
      return out;
    }
    const std::vector<Normal> blocks = sum_up(at, J, out.scale);
    const double s2 = out.scale * out.scale;
    Eigen::MatrixXd H = (s2 * prior).asDiagonal();
    Eigen::VectorXd g = s2 * prior.cwiseProduct(out.x - start);
    for (const Normal& b : blocks) H += b.H, g += b.g;
    const Eigen::MatrixXd inverse = H.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
    if (k == iterations) {
      const Eigen::MatrixXd prior_meat = s2 * s2 * Eigen::MatrixXd(prior.asDiagonal());
      out.cov = inverse * prior_meat * inverse + jackknife(blocks, H);
      // Sherman and Morrison: x without the prior p of one of it is x / (1 - p (H^-1)_ii) there.
      out.growth_without_prior = (1 - s2 * prior.array() * inverse.diagonal().array()).inverse();
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

double median_of(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::ranges::nth_element(x, middle);
  return *middle;
}

}  // namespace kilvo::lab
