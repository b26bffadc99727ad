#include <algorithm>

#include "lab/report/figures.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t sensor_buckets = 600;

struct Intervals {
  std::vector<double> t, ms;
  double median = 0, largest = 0, largest_at = 0;
  std::size_t gaps = 0;  // over three medians and over 1 ms
};

Intervals intervals_of(const TimeBase& time, std::span<const StampedPose> poses) {
  Intervals found;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    found.t.push_back(time.seconds(poses[i].t));
    found.ms.push_back(1e3 * to_seconds(poses[i].t - poses[i - 1].t));
    if (found.ms.back() <= found.largest) continue;
    found.largest = found.ms.back();
    found.largest_at = time.seconds(poses[i - 1].t);
  }
  if (found.ms.empty()) return found;
  std::vector<double> sorted = found.ms;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  found.median = *middle;
  constexpr double times_median = 3, least_ms = 1;
  for (const double ms : found.ms) found.gaps += ms > std::max(times_median * found.median, least_ms) ? 1 : 0;
  return found;
}

/// The longest of each part: what is short is not a gap.
std::vector<std::size_t> longest(const std::vector<double>& ms) {
  const std::size_t parts = std::min(sensor_buckets, ms.size());
  std::vector<std::size_t> kept;
  for (std::size_t part = 0; part < parts; ++part) {
    const auto begin = ms.begin() + static_cast<std::ptrdiff_t>(part * ms.size() / parts);
    const auto end = ms.begin() + static_cast<std::ptrdiff_t>((part + 1) * ms.size() / parts);
    kept.push_back(static_cast<std::size_t>(std::max_element(begin, end) - ms.begin()));
  }
  return kept;
}

Json interval_panel(const char* label, const char* role, const Intervals& intervals) {
  const std::vector<std::size_t> kept = longest(intervals.ms);
  const Json curve = line("interval", role, column(intervals.t, kept, 3), column(intervals.ms, kept, 3));
  return {{"label", label}, {"unit", "ms"}, {"lines", Json::array({curve})}, {"bands", Json::array()}, {"from_zero", true}};
}

Json output_row(const char* name, std::size_t n, const Intervals& intervals, double seconds) {
  return {name,
          n,
          seconds > 0 ? rounded(static_cast<double>(n - 1) / seconds, 1) : Json(nullptr),
          rounded(intervals.largest, 1),
          rounded(intervals.largest_at, 2),
          intervals.gaps};
}

/// What a JSON object holds under `key`; null where that is not there or `json` is no object.
Json at(const Json& json, const char* key) {
  if (!json.is_object() || !json.contains(key)) return nullptr;
  return json[key];
}

Json message_row(const std::string& sensor, const Json& messages, double seconds) {
  const Json used = at(messages, "used"), dropped = at(messages, "dropped"), topic = at(messages, "topic");
  std::string causes;
  if (dropped.is_object())
    for (const auto& [cause, n] : dropped.items()) causes += (causes.empty() ? "" : ", ") + n.dump() + " " + cause;
  const bool rate_known = used.is_number() && seconds > 0;
  return {sensor, topic.is_string() ? Json(topic.get<std::string>()) : Json(""),
          used.is_number() ? Json(used.get<double>()) : Json(nullptr),
          rate_known ? rounded(used.get<double>() / seconds, 1) : Json(nullptr), causes.empty() ? "none" : causes};
}

double seconds_of(const std::vector<StampedPose>& poses) { return poses.size() < 2 ? 0 : to_seconds(poses.back().t - poses.front().t); }

}  // namespace

Figures rate_figures(const TimeBase& time, const RunFiles& run) {
  Figures figures;
  const Json messages = at(run.summary, "messages");
  if (messages.is_object() && !messages.empty()) {
    Json table = figure("table", "messages", "senses", "Messages used", "By sensor; what was dropped, and why.");
    table["columns"] = {"sensor", "topic", "used", "Hz", "dropped"};
    table["rows"] = Json::array();
    for (const auto& [sensor, counts] : messages.items()) table["rows"].push_back(message_row(sensor, counts, seconds_of(run.odometry)));
    figures.push_back(std::move(table));
  }
  if (run.odometry.size() < 2) return figures;
  const Intervals states = intervals_of(time, run.odometry), sweeps = intervals_of(time, run.sweeps);
  Json out = figure("lines", "intervals", "senses", "Time between outputs", "The longest of each part of the run: gaps stand out.");
  out["panels"] = Json::array();
  Json table = figure("table", "rates", "senses", "Rates and gaps", "A gap is longer than three median intervals.");
  table["columns"] = {"output", "number", "Hz", "longest gap, ms", "at, s", "gaps"};
  table["rows"] = Json::array();
  table["rows"].push_back(output_row("odometry", run.odometry.size(), states, seconds_of(run.odometry)));
  if (!sweeps.ms.empty()) {
    out["panels"].push_back(interval_panel("sweeps", "1", sweeps));
    table["rows"].push_back(output_row("sweeps", run.sweeps.size(), sweeps, seconds_of(run.sweeps)));
  }
  out["panels"].push_back(interval_panel("odometry", "0", states));
  figures.push_back(std::move(table));
  figures.push_back(std::move(out));
  return figures;
}

Figures modality_figures(const TimeBase& time, const RunFiles& run) {
  if (run.modality.empty()) return {};
  Json out = figure("strip", "modality", "senses", "Modality", "K legs, I inertial unit, L LiDAR, V camera.");
  Time end = run.modality.back().t;
  if (!run.odometry.empty()) end = std::max(end, run.odometry.back().t);
  Json spans = Json::array();
  for (std::size_t i = 0; i < run.modality.size(); ++i) {
    const ModalityRow& row = run.modality[i];
    const Time until = i + 1 < run.modality.size() ? run.modality[i + 1].t : end;
    spans.push_back({rounded(time.seconds(row.t), 3), rounded(time.seconds(until), 3), row.modality, row.modality + ": " + row.cause});
  }
  out["rows"] = Json::array({{{"label", "modality"}, {"spans", std::move(spans)}}});
  out["named"] = true;
  return {out};
}

}  // namespace kilvo::lab
