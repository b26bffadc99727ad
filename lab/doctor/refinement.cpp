#include "lab/doctor/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kilvo::lab {
namespace {

constexpr double significant_change = 3;  // standard deviations

std::string numbers(const std::vector<double>& x) {
  std::vector<std::string> out;
  for (const double v : x) out.push_back(fmt::format("{:.4g}", v + 0.0));  // no "-0"
  return fmt::format("({})", fmt::join(out, ", "));
}

// Of what the true values differ from the described ones by: the most likely variance under which values measured with `sigma` differ by
// `change`. H. Robbins, "An empirical Bayes approach to statistics", 1956; C. N. Morris, "Parametric empirical Bayes inference", 1983.
double prior_variance(const std::vector<double>& change, const std::vector<double>& sigma, double largest_sigma) {
  // Derivative of the likelihood.
  const auto slope = [&](double variance) {
    double sum = 0;
    for (std::size_t i = 0; i < change.size(); ++i) {
      if (!(sigma[i] <= largest_sigma)) continue;
      const double all = variance + sigma[i] * sigma[i];
      sum += (change[i] * change[i] - all) / (all * all);
    }
    return sum;
  };
  double low = 0, high = 0;
  for (const double x : change) high = std::max(high, x * x);
  if (!(slope(low) > 0)) return 0;
  constexpr int halvings = 50;
  for (int k = 0; k < halvings; ++k) {
    const double middle = 0.5 * (low + high);
    (slope(middle) > 0 ? low : high) = middle;
  }
  return low;
}

// The same of one component by itself: what another one is off by says little of it. B. Efron, C. Morris, "Limiting the risk of Bayes and
// empirical Bayes estimators", 1972.
double own_share(double change, double sigma) { return change != 0 ? std::max(0.0, 1 - sigma * sigma / (change * change)) : 0; }

}  // namespace

bool Refinement::is_taken() const {
  return std::ranges::any_of(taken, [](double x) { return x != 0; });
}

Refinement refinement(Sensor sensor, const std::string& what, std::vector<double> change, std::vector<double> sigma, double method,
                      double largest_sigma, const std::string& unit) {
  Refinement out;
  out.sensor = sensor;
  out.what = what;
  out.unit = unit;
  out.observable = false;
  for (double& s : sigma) s = std::hypot(s, method);
  const double variance = prior_variance(change, sigma, largest_sigma);
  for (std::size_t i = 0; i < change.size(); ++i) {
    const bool known = sigma[i] <= largest_sigma;
    out.observable = out.observable || known;
    out.significant = out.significant || (known && std::abs(change[i]) > significant_change * sigma[i]);
    // Of a single number no estimator is better than what is described wherever that is right (C. Stein, 1956): it must be significant.
    const bool is_taken = known && (change.size() > 1 || out.significant);
    out.taken.push_back(is_taken ? change[i] * std::min(variance / (variance + sigma[i] * sigma[i]), own_share(change[i], sigma[i])) : 0);
  }
  out.change = std::move(change);
  out.sigma = std::move(sigma);
  if (!out.observable) out.advice = "walk longer, and turn both ways";
  return out;
}

std::string to_text(const std::vector<Refinement>& refinements) {
  std::string out;
  for (const Refinement& r : refinements) {
    const std::string done = !r.observable ? fmt::format("not observable, kept: {}", r.advice)
                             : r.changes.empty() && r.significant
                                 ? std::string("off: there is no setting for it, the robot itself has to be calibrated")
                             : r.changes.empty() || !r.is_taken() ? std::string("as described")
                                                                  : fmt::format("changed by {}", numbers(r.taken));
    out += fmt::format("{:<6} {}: {} {}, standard deviation {}: {}\n", name_of(r.sensor), r.what, numbers(r.change), r.unit,
                       numbers(r.sigma), done);
  }
  return out;
}

std::string to_json(const std::vector<Refinement>& refinements) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  const auto finite = [](std::vector<double> x) {
    for (double& v : x) v = std::isfinite(v) ? v : 1e9;
    return x;
  };
  for (const Refinement& r : refinements) {
    nlohmann::ordered_json changes = nlohmann::ordered_json::object();
    if (r.is_taken()) {
      for (const Change& c : r.changes) changes[c.key] = c.value;
    }
    out.push_back({{"sensor", name_of(r.sensor)},
                   {"what", r.what},
                   {"change", finite(r.change)},
                   {"sigma", finite(r.sigma)},
                   {"taken", r.taken},
                   {"unit", r.unit},
                   {"observable", r.observable},
                   {"significant", r.significant},
                   {"advice", r.advice},
                   {"settings", changes}});
  }
  return out.dump(2) + "\n";
}

}  // namespace kilvo::lab
