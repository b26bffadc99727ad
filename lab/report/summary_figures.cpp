#include <fmt/core.h>

#include "lab/report/figures.hpp"

namespace kilvo::lab {
namespace {

struct Headline {
  std::string label, value, unit, note;
  bool bad = false;
};

void add(Json& cards, const Headline& h) {
  cards.push_back({{"label", h.label}, {"value", h.value}, {"unit", h.unit}, {"note", h.note}, {"bad", h.bad}});
}

std::optional<double> number(const Json& json, const char* key) {
  if (!json.is_object() || !json.contains(key) || !json[key].is_number()) return std::nullopt;
  return json[key].get<double>();
}

bool is_true(const Json& json, const char* key) { return json.is_object() && json.contains(key) && json[key] == true; }

/// A length in mm below 1 m.
std::pair<std::string, std::string> length(double metres) {
  if (metres < 1) return {fmt::format("{:.1f}", 1e3 * metres), "mm"};
  return {fmt::format("{:.2f}", metres), "m"};
}

void add_errors(Json& cards, const Evaluation& e) {
  const Divergence judged = judge_divergence(e);
  const auto [ate, ate_unit] = length(e.ate_rmse_m);
  const auto [most, most_unit] = length(e.ate_max_m);
  add(cards, {"Position error", ate, ate_unit, fmt::format("rms; {} {} at most", most, most_unit), judged.diverged});
  add(cards, {"Rotation error", fmt::format("{:.3f}", e.rotation_rmse_deg), "°", "rms", false});
  const auto [e2e, e2e_unit] = length(e.e2e_m);
  add(cards, {"Drift", e2e, e2e_unit, "from start to end", false});
}

/// name, value; the names of what lies deeper are joined by dots.
void flatten(const Json& json, const std::string& name, Json& rows) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) flatten(value, name.empty() ? key : name + "." + key, rows);
  } else if (json.is_array()) {
    std::string list;
    for (const auto& item : json) {
      list += list.empty() ? "" : ", ";
      list += item.is_number() ? fmt::format("{:.6g}", item.get<double>()) : item.is_string() ? item.get<std::string>() : item.dump();
    }
    rows.push_back({name, list});
  } else if (json.is_number_float()) {
    rows.push_back({name, fmt::format("{:.9g}", json.get<double>())});
  } else {
    rows.push_back({name, json.is_string() ? json.get<std::string>() : json.is_null() ? "none" : json.dump()});
  }
}

}  // namespace

Json headlines(const RunFiles& run, const Way& way, const std::optional<ContactEvaluation>& contacts) {
  Json cards = Json::array();
  if (way.evaluation) add_errors(cards, *way.evaluation);
  if (contacts) {
    const auto rate = contacts->false_positive_rate;
    add(cards, {"Contacts right", fmt::format("{:.1f}", 100 * contacts->accuracy), "%",
                rate ? fmt::format("false positives {:.1f} %", 100 * *rate) : "", false});
  }
  if (const auto path = number(run.summary, "path_length_m")) {
    const double seconds = run.odometry.empty() ? 0 : to_seconds(run.odometry.back().t - run.odometry.front().t);
    add(cards, {"Way", fmt::format("{:.1f}", *path), "m", fmt::format("in {:.1f} s", seconds), false});
  }
  if (const auto frame = number(run.summary, "mean_ms_per_frame")) {
    const auto factor = number(run.summary, "real_time_factor");
    add(cards, {"Per frame", fmt::format("{:.2f}", *frame), "ms", factor ? fmt::format("{:.0f} × real time", *factor) : "", false});
  }
  if (const auto memory = number(run.summary, "peak_memory_mb"))
    add(cards, {"Memory", fmt::format("{:.0f}", *memory), "MB", "at most", false});
  if (is_true(run.summary, "diverged")) add(cards, {"Run", "diverged", "", "judged by the estimator itself", true});
  if (is_true(run.summary, "input_damaged")) add(cards, {"Recording", "damaged", "", "run as far as it is good", true});
  return cards;
}

Figures summary_figures(const Json& summary) {
  if (summary.empty()) return {};
  Json table = figure("table", "summary", "all", "Summary", "All of summary.json but the configuration.");
  table["columns"] = {"", ""};
  table["rows"] = Json::array();
  Json rest = summary;
  rest.erase("config");
  flatten(rest, "", table["rows"]);
  table["plain"] = true;
  Figures figures{table};
  if (summary.contains("config")) {
    Json config = figure("table", "config", "all", "Configuration", "Every setting as used.");
    config["columns"] = {"", ""};
    config["rows"] = Json::array();
    flatten(summary["config"], "", config["rows"]);
    config["plain"] = config["folded"] = true;
    if (!config["rows"].empty()) figures.push_back(config);
  }
  return figures;
}

}  // namespace kilvo::lab
