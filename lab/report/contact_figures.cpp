#include <algorithm>
#include <cmath>

#include "lab/report/figures.hpp"
#include "lab/report/thin.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t contact_buckets = 1200;

/// The stances of a foot as [begin, end, class, text], s. What has no end known (legs lost) ends with its samples.
Json spans(const TimeBase& time, std::span<const ContactSample> samples, Foot foot) {
  Json out = Json::array();
  for (const Stance& stance : stances(samples, foot)) {
    const double begin = time.seconds(stance.begin.value_or(stance.first)), end = time.seconds(stance.end.value_or(stance.last));
    out.push_back({rounded(begin, 3), rounded(end, 3), foot_names[foot], "in contact"});
  }
  return out;
}

Json strip(const TimeBase& time, std::span<const ContactSample> estimate, std::span<const ContactSample> truth,
           const std::optional<ContactEvaluation>& evaluation) {
  std::string note = "Filled while the foot stands.";
  if (evaluation) {
    const auto events = [&](Foot foot) {
      return std::to_string(evaluation->feet[foot].correct) + " of " + std::to_string(evaluation->feet[foot].true_events);
    };
    note += " Touchdowns found: left " + events(left_foot) + ", right " + events(right_foot) + ".";
  }
  Json out = figure("strip", "contacts", "feet", "Contacts", note);
  out["rows"] = Json::array();
  for (const Foot foot : {left_foot, right_foot}) {
    if (!estimate.empty()) out["rows"].push_back({{"label", foot_names[foot]}, {"spans", spans(time, estimate, foot)}});
    if (!truth.empty()) {
      Json real = spans(time, truth, foot);
      for (Json& span : real) span[2] = "truth";
      out["rows"].push_back({{"label", std::string("true ") + foot_names[foot]}, {"spans", std::move(real)}});
    }
  }
  return out;
}

Json clearance(const TimeBase& time, const std::vector<ContactRow>& contacts) {
  Json out = figure("lines", "clearance", "feet", "Clearance", "Height of each sole above the ground, as estimated.");
  std::vector<double> t;
  std::vector<std::vector<double>> columns(2);
  constexpr double lost = 0.1;  // s without a row: nothing is drawn in between
  for (const ContactRow& row : contacts) {
    if (!t.empty() && time.seconds(row.sample.t) - t.back() > lost) {
      t.push_back(t.back());
      for (std::vector<double>& column : columns) column.push_back(NAN);
    }
    t.push_back(time.seconds(row.sample.t));
    for (const Foot foot : {left_foot, right_foot}) columns[foot].push_back(row.clearance[foot] * 1e3);
  }
  const auto kept = thin(columns, contact_buckets);
  Json lines = Json::array();
  for (const Foot foot : {left_foot, right_foot})
    lines.push_back(line(foot_names[foot], foot_names[foot], column(t, kept, 3), column(columns[foot], kept, 1)));
  out["panels"] = Json::array({{{"label", "clearance"}, {"unit", "mm"}, {"lines", std::move(lines)}, {"bands", Json::array()}}});
  return out;
}

/// How many errors lie in each 5 ms from -100 to 100 ms.
Json transition_errors(const ContactEvaluation& evaluation) {
  constexpr int bins = 40;
  constexpr double width = 5, first = -100;
  Json out =
      figure("bars", "transitions", "feet", "Errors of transitions", "Estimated minus true, of the matched ones: left of zero is early.");
  out["x_label"] = "ms";
  out["log"] = false;
  out["edges"] = Json::array();
  for (int i = 0; i <= bins; ++i) out["edges"].push_back(first + width * i);
  std::vector<int> touchdowns(bins, 0), liftoffs(bins, 0);
  const auto count = [&](const std::vector<double>& errors, std::vector<int>& into) {
    for (const double error : errors) ++into[static_cast<std::size_t>(std::clamp(static_cast<int>((error - first) / width), 0, bins - 1))];
  };
  for (const FootEvaluation& foot : evaluation.feet) {
    count(foot.touchdown_errors_ms, touchdowns);
    count(foot.liftoff_errors_ms, liftoffs);
  }
  out["groups"] = {{{"name", "touchdown"}, {"role", "0"}, {"counts", touchdowns}},
                   {{"name", "lift-off"}, {"role", "1"}, {"counts", liftoffs}}};
  return out;
}

Json table(const ContactEvaluation& e) {
  Json out = figure("table", "contact_table", "feet", "Contacts in numbers", "From the first true lift-off to the last true touchdown.");
  out["columns"] = {"", "left", "right"};
  const auto percent = [](const std::optional<double>& share) { return share ? Json(rounded(100 * *share, 2)) : Json("unknown"); };
  const FootEvaluation &l = e.feet[left_foot], &r = e.feet[right_foot];
  const auto median = [](const std::vector<double>& errors) {
    return errors.empty() ? Json("unknown") : Json(rounded(distribution(errors).p50, 1));
  };
  out["rows"] = {{"accuracy, %", percent(l.accuracy), percent(r.accuracy)},
                 {"false positives, %", percent(l.false_positive_rate), percent(r.false_positive_rate)},
                 {"true touchdowns", l.true_events, r.true_events},
                 {"found and whole", l.correct, r.correct},
                 {"found with a gap", l.gaps, r.gaps},
                 {"missed", l.missed, r.missed},
                 {"not real", l.extra, r.extra},
                 {"touchdown error, median ms", median(l.touchdown_errors_ms), median(r.touchdown_errors_ms)},
                 {"lift-off error, median ms", median(l.liftoff_errors_ms), median(r.liftoff_errors_ms)}};
  return out;
}

}  // namespace

Figures contact_figures(const TimeBase& time, const std::vector<ContactRow>& contacts, std::span<const ContactSample> truth,
                        const std::optional<ContactEvaluation>& evaluation) {
  if (contacts.empty() && truth.empty()) return {};
  std::vector<ContactSample> estimate;
  bool any_clearance = false;
  for (const ContactRow& row : contacts) {
    estimate.push_back(row.sample);
    any_clearance = any_clearance || std::isfinite(row.clearance[0]) || std::isfinite(row.clearance[1]);
  }
  Figures figures{strip(time, estimate, truth, evaluation)};
  if (any_clearance) figures.push_back(clearance(time, contacts));
  if (!evaluation) return figures;
  figures.push_back(transition_errors(*evaluation));
  figures.push_back(table(*evaluation));
  return figures;
}

}  // namespace kilvo::lab
