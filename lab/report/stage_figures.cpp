#include <algorithm>
#include <cmath>
#include <map>

#include "lab/report/figures.hpp"
#include "lab/report/thin.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t stage_buckets = 500;

struct Stage {
  std::vector<double> t, us;
};

Json table(const std::map<std::string, Stage>& stages) {
  Json out = figure("table", "stage_table", "time", "Stages in numbers", "Microseconds.");
  out["columns"] = {"stage", "median", "99 %", "most", "number"};
  out["rows"] = Json::array();
  for (const auto& [name, stage] : stages) {
    std::vector<double> sorted = stage.us;
    std::sort(sorted.begin(), sorted.end());
    const auto quantile = [&](double share) {
      return rounded(sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))], 1);
    };
    out["rows"].push_back({name, quantile(0.5), quantile(0.99), rounded(sorted.back(), 1), sorted.size()});
  }
  return out;
}

/// Bins that are equally wide on a logarithmic axis. What took no time at all falls into the first.
Json histogram(const std::map<std::string, Stage>& stages) {
  constexpr std::size_t bins = 60;
  constexpr double least_us = 0.1;
  double low = INFINITY, high = 2 * least_us;
  for (const auto& [name, stage] : stages) {
    for (const double us : stage.us) {
      low = std::min(low, std::max(us, least_us));
      high = std::max(high, us);
    }
  }
  const double from = std::log10(low) - 0.01, step = (std::log10(std::max(high, low * 2)) + 0.01 - from) / static_cast<double>(bins);
  Json out = figure("bars", "stage_histogram", "time", "How often a stage took how long", "In percent of each stage's own number.");
  out["x_label"] = "µs";
  out["log"] = true;
  out["edges"] = Json::array();
  for (std::size_t i = 0; i <= bins; ++i) out["edges"].push_back(rounded(std::pow(10, from + step * static_cast<double>(i)), 3));
  out["groups"] = Json::array();
  std::size_t number = 0;
  for (const auto& [name, stage] : stages) {
    std::vector<std::size_t> counts(bins, 0);
    for (const double us : stage.us) {
      const double bin = (std::log10(std::max(us, least_us)) - from) / step;
      ++counts[static_cast<std::size_t>(std::clamp(bin, 0.0, static_cast<double>(bins - 1)))];
    }
    Json shares = Json::array();
    for (const std::size_t n : counts) shares.push_back(rounded(100.0 * static_cast<double>(n) / static_cast<double>(stage.us.size()), 3));
    out["groups"].push_back({{"name", name}, {"role", std::to_string(number++)}, {"counts", std::move(shares)}});
  }
  return out;
}

}  // namespace

Figures stage_figures(const TimeBase& time, const std::vector<StageRow>& timing) {
  std::map<std::string, Stage> stages;
  for (const StageRow& row : timing) {
    stages[row.stage].t.push_back(time.seconds(row.t));
    stages[row.stage].us.push_back(row.microseconds);
  }
  if (stages.empty()) return {};
  Json over_time = figure("lines", "stages", "time", "Stage times over the run", "Wall clock of each stage.");
  over_time["panels"] = Json::array();
  std::size_t number = 0;
  for (const auto& [name, stage] : stages) {
    const auto kept = thin(std::span(&stage.us, 1), stage_buckets);
    const Json curve = line(name, std::to_string(number++), column(stage.t, kept, 3), column(stage.us, kept, 1));
    over_time["panels"].push_back(
        {{"label", name}, {"unit", "µs"}, {"lines", Json::array({curve})}, {"bands", Json::array()}, {"from_zero", true}});
  }
  return {over_time, histogram(stages), table(stages)};
}

}  // namespace kilvo::lab
