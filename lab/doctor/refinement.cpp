#include "lab/doctor/refinement.hpp"

#include <cmath>
#include <fmt/core.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kilvo::lab {
namespace {

constexpr double significant_change = 3;  // standard deviations

std::string numbers(const std::vector<double>& x) {
  std::vector<std::string> out;
  for (const double v : x) out.push_back(fmt::format("{:.4g}", v));
  return fmt::format("({})", fmt::join(out, ", "));
}

}  // namespace

Refinement refinement(Sensor sensor, const std::string& what, std::vector<double> change, std::vector<double> sigma, double method,
                      double largest_sigma, const std::string& unit) {
  Refinement out;
  out.sensor = sensor;
  out.what = what;
  out.unit = unit;
  for (std::size_t i = 0; i < change.size(); ++i) {
    sigma[i] = std::hypot(sigma[i], method);
    const bool known = std::isfinite(sigma[i]) && sigma[i] <= largest_sigma;
    out.observable = out.observable && known;
    out.significant = out.significant || (known && std::abs(change[i]) > significant_change * sigma[i]);
  }
  out.significant = out.significant && out.observable;
  out.change = std::move(change);
  out.sigma = std::move(sigma);
  if (!out.observable) out.advice = "walk longer, and turn both ways";
  return out;
}

std::string to_text(const std::vector<Refinement>& refinements) {
  std::string out;
  for (const Refinement& r : refinements) {
    const std::string done = !r.observable       ? fmt::format("not observable, kept: {}", r.advice)
                             : !r.significant    ? std::string("as described")
                             : r.changes.empty() ? std::string("off: there is no setting for it, the robot itself has to be calibrated")
                                                 : std::string("changed");
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
    if (r.significant) {
      for (const Change& c : r.changes) changes[c.key] = c.value;
    }
    out.push_back({{"sensor", name_of(r.sensor)},
                   {"what", r.what},
                   {"change", finite(r.change)},
                   {"sigma", finite(r.sigma)},
                   {"unit", r.unit},
                   {"observable", r.observable},
                   {"significant", r.significant},
                   {"advice", r.advice},
                   {"settings", changes}});
  }
  return out.dump(2) + "\n";
}

}  // namespace kilvo::lab
