#include "apps/cli/summary.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <fstream>
#include <nlohmann/json.hpp>

#include "lab/settings/show_settings.hpp"

namespace kilvo::cli {
namespace {

using Json = nlohmann::ordered_json;

// The largest the program has been, from the kernel's own book.
double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  }
  return 0;
}

double tenths(double x) { return std::round(x * 10) / 10; }

Json pose_json(const std::optional<StampedState>& state) {
  if (!state) return nullptr;
  const Eigen::Vector3d& p = state->T_WI.p;
  const Eigen::Quaterniond q = state->T_WI.R.quaternion();
  return {{"t", to_seconds(state->t.time_since_epoch())}, {"p", {p.x(), p.y(), p.z()}}, {"q_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

Json messages_json(const RunFacts& facts, const lab::RecordingSource& source, const Statistics& statistics) {
  Json out = Json::object();
  for (const Sensor sensor : facts.sensors) {
    const SensorCount& estimator = statistics.sensors[static_cast<std::size_t>(sensor)];
    std::map<std::string, std::uint64_t> dropped = source.counts(sensor).dropped;
    for (const auto& [cause, n] : estimator.dropped) dropped[cause] += n;
    if (const std::uint64_t n = facts.withheld[static_cast<std::size_t>(sensor)]; n > 0) dropped["drop_option"] = n;
    out[name_of(sensor)] = {{"topic", source.topic(sensor)}, {"used", estimator.used}, {"dropped", dropped}};
    if (const auto& by = source.clocks().offset(sensor)) out[name_of(sensor)]["clock_moved_s"] = to_seconds(*by);
  }
  return out;
}

// Of the streams themselves: intervals between stamps, and what was wrong with the messages.
Json health_json(const RunFacts& facts, const Statistics& statistics) {
  Json out = Json::object();
  for (const Sensor sensor : facts.sensors) {
    const StreamHealth& h = statistics.health[static_cast<std::size_t>(sensor)];
    const auto count = [&](const char* cause) {
      const auto& dropped = statistics.sensors[static_cast<std::size_t>(sensor)].dropped;
      const auto it = dropped.find(cause);
      return it == dropped.end() ? std::uint64_t{0} : it->second;
    };
    out[name_of(sensor)] = {{"messages", h.messages},
                            {"rate_hz", h.mean_interval > 0 ? tenths(1 / h.mean_interval) : 0},
                            {"jitter_ms", tenths(1e3 * h.jitter)},
                            {"longest_gap_s", h.longest_gap},
                            {"duplicates", count("duplicate")},
                            {"repeated", h.repeated},
                            {"frozen", h.frozen},
                            {"not_finite", count("not finite")},
                            {"clipped", h.clipped},
                            {"off_clock", h.off_clock},
                            {"clock_offset_s", h.clock_offset},
                            {"lag_s", h.mean_lag}};
  }
  return out;
}

// One for each sensor and reason, as it was last.
Json events_json(const Statistics& statistics, const std::optional<Event>& levelled) {
  std::vector<Event> events = statistics.events;
  if (levelled) events.push_back(*levelled);
  Json out = Json::array();
  for (const Event& e : events) {
    out.push_back({{"t", to_seconds(e.t.time_since_epoch())},
                   {"sensor", e.sensor ? Json(name_of(*e.sensor)) : Json()},
                   {"reason", name_of(e.reason)},
                   {"severity", name_of(row_of(e.reason).severity)},
                   {"count", e.count},
                   {"value", e.value},
                   {"text", text_of(e)}});
  }
  return out;
}

bool has_diverged(const Statistics& statistics) {
  return std::ranges::any_of(statistics.events, [](const Event& e) { return e.reason == Reason::diverged; });
}

Json recovery_json(const Statistics& statistics, std::uint64_t live_steps) {
  return {{"imu_outages", statistics.imu_outages},
          {"clock_steps", statistics.clock_steps + live_steps},
          {"searches", statistics.searches},
          {"found", statistics.found},
          {"maps_begun_anew", statistics.maps_begun_anew}};
}

Json points_json(const RunFacts& facts, const lab::RecordingSource& source, const Statistics& statistics) {
  const PointDrops& drops = statistics.points;
  Json out{{"non_finite", drops.non_finite}, {"at_origin", drops.at_origin}, {"too_near", drops.too_near},
           {"too_far", drops.too_far},       {"own_body", drops.own_body},   {"outside_trajectory", drops.outside_trajectory}};
  out["absurd_time"] = source.counts(Sensor::lidar).absurd_point_times;
  out["in_map"] = facts.map_points;
  return out;
}

Json stages_json(const RunSummary& run_summary) {
  Json out = Json::object();
  for (const auto& [stage, q] : run_summary.stages.quantiles()) {
    out[stage] = {{"p50", tenths(q.p50)}, {"p99", tenths(q.p99)}, {"max", tenths(q.max)}, {"n", q.n}};
  }
  return out;
}

// Of the live runner: how soon it answered, and what it had to give up for that.
void add_live(Json& json, const RunFacts& facts) {
  const live::LiveStatistics& live = *facts.live;
  const auto ms = [](double seconds) { return std::round(1e6 * seconds) / 1e3; };
  json["latency_ms"] = {{"p50", ms(live.latency.quantile(0.5))},
                        {"p99", ms(live.latency.quantile(0.99))},
                        {"p99_9", ms(live.latency.quantile(0.999))},
                        {"max", ms(live.latency.max())},
                        {"n", live.latency.count()}};
  json["deadline_misses"] = live.deadline_misses;
  json["correction_ms"] = {{"p50", ms(live.correction.quantile(0.5))},
                           {"p99", ms(live.correction.quantile(0.99))},
                           {"max", ms(live.correction.max())},
                           {"n", live.correction.count()}};
  Json drops = Json::object();
  for (const Sensor s : facts.sensors) drops[name_of(s)] = live.dropped[static_cast<std::size_t>(s)];
  drops["outputs"] = live.dropped_outputs;
  json["queue_drops"] = drops;
  json["queue_depth"] = live.deepest;
  Json cpu = Json::object();
  for (const auto& [thread, seconds] : live.cpu_seconds)
    cpu[thread] = facts.wall_seconds > 0 ? tenths(100 * seconds / facts.wall_seconds) : 0;
  json["cpu_percent"] = cpu;
}

// A setting may hold any bytes; a summary is UTF-8.
Json config_json(const lab::Settings& settings) {
  std::string text = lab::settings_json(settings);
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_discarded()) return json;
  for (char& c : text) c = (static_cast<unsigned char>(c) & 0x80U) != 0 ? '?' : c;
  return Json::parse(text, nullptr, false);
}

}  // namespace

std::vector<std::string> all_warnings(const RunFacts& facts, const lab::RecordingSource& source, const Statistics& statistics) {
  std::vector<std::string> out = facts.warnings;
  for (const std::string& text : source.warnings()) out.push_back(text);
  for (const std::string& text : warnings_of(statistics)) out.push_back(text);
  if (facts.live) {
    out.insert(out.end(), facts.live->warnings.begin(), facts.live->warnings.end());
    for (const Sensor s : facts.sensors) {
      if (const auto given_up = facts.live->dropped[static_cast<std::size_t>(s)]; given_up > 0)
        out.push_back(fmt::format("live: {} messages of {} were given up: this machine was too slow for them", given_up, name_of(s)));
    }
  }
  return out;
}

std::string summary_json(const RunFacts& facts, const lab::Settings& settings, const lab::RecordingSource& source,
                         const Statistics& statistics, const std::optional<Event>& levelled, const RunSummary& run_summary) {
  Json json;
  json["version"] = KILVO_VERSION;
  json["input"] = facts.input;
  json["config_file"] = facts.config_file;
  json["failure"] = facts.failure.empty() ? Json() : Json(facts.failure);
  json["diverged"] = has_diverged(statistics) || !run_summary.absurdity().empty();
  json["input_damaged"] = source.input_damaged();
  json["messages"] = messages_json(facts, source, statistics);
  json["health"] = health_json(facts, statistics);
  json["recovery"] = recovery_json(statistics, facts.live ? facts.live->clock_steps : 0);
  json["degraded"] = run_summary.degraded;
  json["points"] = points_json(facts, source, statistics);
  json["events"] = events_json(statistics, levelled);
  json["warnings"] = all_warnings(facts, source, statistics);
  json["rollbacks"] = statistics.rollbacks;
  json["lost_stances"] = statistics.lost_stances;
  json["contact_events"] = {{"left", run_summary.contact_events()[0]}, {"right", run_summary.contact_events()[1]}};
  json["modality_seconds"] = run_summary.modality_seconds();
  json["outputs"] = run_summary.outputs();
  json["sweeps"] = run_summary.sweeps();
  json["path_length_m"] = run_summary.path_length();
  json["first_pose"] = pose_json(run_summary.first());
  json["last_pose"] = pose_json(run_summary.last());
  json["start_to_end_m"] = run_summary.start_to_end();
  json["stage_us"] = stages_json(run_summary);
  json["mean_ms_per_frame"] = run_summary.sweeps() == 0 ? 0 : run_summary.stages.total() * 1e-3 / static_cast<double>(run_summary.sweeps());
  if (facts.live) add_live(json, facts);
  json["data_seconds"] = run_summary.seconds();
  json["wall_seconds"] = facts.wall_seconds;
  json["real_time_factor"] = facts.wall_seconds > 0 ? run_summary.seconds() / facts.wall_seconds : 0;
  json["peak_memory_mb"] = tenths(peak_memory_mb());
  json["config"] = config_json(settings);
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace kilvo::cli
