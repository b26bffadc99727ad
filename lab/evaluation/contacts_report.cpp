#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "lab/evaluation/contacts.hpp"

namespace kilvo::lab {
namespace {

using Json = nlohmann::ordered_json;

/// Quantile of sorted numbers, linear between neighbours.
double quantile(const std::vector<double>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

Json errors_json(const std::vector<double>& errors_ms) {
  const TransitionErrors d = distribution(errors_ms);
  return {{"n", d.n},
          {"min", d.min},
          {"p5", d.p5},
          {"p50", d.p50},
          {"p95", d.p95},
          {"max", d.max},
          {"early", d.early},
          {"late", d.late},
          {"mean_early", d.mean_early},
          {"mean_late", d.mean_late},
          {"all", errors_ms}};
}

Json foot_json(const FootEvaluation& foot) {
  Json json;
  json["accuracy"] = foot.accuracy;
  json["false_positive_rate"] = foot.false_positive_rate ? Json(*foot.false_positive_rate) : Json();
  json["compared"] = foot.compared;
  json["true_events"] = foot.true_events;
  json["estimated_events"] = foot.estimated_events;
  json["matched"] = foot.matched;
  json["gaps"] = foot.gaps;
  json["correct"] = foot.correct;
  json["missed"] = foot.missed;
  json["extra"] = foot.extra;
  json["uncovered"] = foot.uncovered;
  json["touchdown_errors_ms"] = errors_json(foot.touchdown_errors_ms);
  json["liftoff_errors_ms"] = errors_json(foot.liftoff_errors_ms);
  return json;
}

std::string percent(const std::optional<double>& share) { return share ? fmt::format("{:.2f} %", 100 * *share) : "unknown"; }

std::string errors_text(const std::vector<double>& errors_ms) {
  const TransitionErrors d = distribution(errors_ms);
  if (d.n == 0) return "none matched";
  return fmt::format(
      "median {:+.1f}, 5 % {:+.1f}, 95 % {:+.1f}, from {:+.1f} to {:+.1f} ms; {} early (mean {:+.1f}), {} late (mean {:+.1f})", d.p50, d.p5,
      d.p95, d.min, d.max, d.early, d.mean_early, d.late, d.mean_late);
}

}  // namespace

TransitionErrors distribution(std::vector<double> errors_ms) {
  TransitionErrors d;
  d.n = errors_ms.size();
  if (d.n == 0) return d;
  std::sort(errors_ms.begin(), errors_ms.end());
  d.min = errors_ms.front();
  d.p5 = quantile(errors_ms, 0.05);
  d.p50 = quantile(errors_ms, 0.5);
  d.p95 = quantile(errors_ms, 0.95);
  d.max = errors_ms.back();
  for (const double error : errors_ms) {
    d.early += error < 0 ? 1 : 0;
    d.late += error > 0 ? 1 : 0;
    (error < 0 ? d.mean_early : d.mean_late) += error;
  }
  if (d.early > 0) d.mean_early /= static_cast<double>(d.early);
  if (d.late > 0) d.mean_late /= static_cast<double>(d.late);
  return d;
}

std::string to_json(const ContactEvaluation& e) {
  Json json;
  json["accuracy"] = e.accuracy;
  json["false_positive_rate"] = e.false_positive_rate ? Json(*e.false_positive_rate) : Json();
  json["walks"] = e.walks;
  json["window_s"] = to_seconds(e.end - e.begin);
  json["coverage"] = e.coverage;
  for (const Foot foot : {left_foot, right_foot}) json[foot_names[foot]] = foot_json(e.feet[foot]);
  return json.dump(2) + "\n";
}

std::string to_text(const ContactEvaluation& e) {
  std::string text;
  const auto row = [&](const std::string& name, const std::string& value) { text += fmt::format("{:<20}{}\n", name, value); };
  row("compared", fmt::format("{:.1f} s {}, estimated for {:.1f} % of it", to_seconds(e.end - e.begin),
                              e.walks ? "from the first lift-off to the last touchdown" : "(the truth has no step)", 100 * e.coverage));
  row("accuracy", fmt::format("{} (left {}, right {})", percent(e.accuracy), percent(e.feet[0].accuracy), percent(e.feet[1].accuracy)));
  row("false positive rate", fmt::format("{} (left {}, right {})", percent(e.false_positive_rate), percent(e.feet[0].false_positive_rate),
                                         percent(e.feet[1].false_positive_rate)));
  row("events", fmt::format("{}/{} correct of {}/{} true (left/right)", e.feet[0].correct, e.feet[1].correct, e.feet[0].true_events,
                            e.feet[1].true_events));
  for (const Foot foot : {left_foot, right_foot}) {
    const FootEvaluation& f = e.feet[foot];
    row(fmt::format("{} events", foot_names[foot]),
        fmt::format("{} estimated, {} matched within 100 ms, {} with a gap, {} missed, {} extra", f.estimated_events, f.matched, f.gaps,
                    f.missed, f.extra) +
            (f.uncovered > 0 ? fmt::format("; {} more while nothing was estimated", f.uncovered) : ""));
    row(fmt::format("{} touchdowns", foot_names[foot]), errors_text(f.touchdown_errors_ms));
    row(fmt::format("{} lift-offs", foot_names[foot]), errors_text(f.liftoff_errors_ms));
  }
  return text;
}

}  // namespace kilvo::lab
