#include <cmath>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "lab/evaluation/evaluate.hpp"

namespace kilvo::lab {
namespace {

nlohmann::json or_null(const std::optional<double>& value) { return value ? nlohmann::json(*value) : nlohmann::json(); }

std::string length(double metres) {
  if (std::abs(metres) >= 1.0) return fmt::format("{:.3f} m", metres);
  return fmt::format("{:.2f} mm", std::round(1e5 * metres) / 100 + 0.0);  // + 0.0: no "-0.00"
}

std::string length(const std::optional<double>& metres) { return metres ? length(*metres) : "unknown (too short)"; }

}  // namespace

std::string to_json(const Evaluation& e) {
  const Divergence judged = judge_divergence(e);
  nlohmann::ordered_json json;
  json["align"] = name_of(e.alignment);
  json["estimates"] = e.estimates;
  json["matches"] = e.matches;
  json["ate_rmse_m"] = e.ate_rmse_m;
  json["ate_max_m"] = e.ate_max_m;
  if (e.ate_rmse_yaw_m) json["ate_rmse_yaw_m"] = *e.ate_rmse_yaw_m;
  json["rotation_rmse_deg"] = e.rotation_rmse_deg;
  json["rte_1m_m"] = or_null(e.rte_1m_m);
  json["rte_1m_percent"] = or_null(e.rte_1m_percent);
  json["rte_1s_m"] = or_null(e.rte_1s_m);
  json["e2e_m"] = e.e2e_m;
  json["e2e_z_m"] = e.e2e_z_m;
  json["e2e_length_m"] = e.e2e_length_m;
  json["coverage"] = e.coverage;
  json["duration_s"] = e.duration_s;
  json["path_length_m"] = e.path_length_m;
  json["rate_hz"] = e.rate_hz;
  json["largest_gap_s"] = e.largest_gap_s;
  json["largest_jump_m"] = e.largest_jump_m;
  json["diverged"] = judged.diverged;
  json["divergence_limit_m"] = judged.limit_m;
  return json.dump(2) + "\n";
}

std::string to_text(const Evaluation& e) {
  const Divergence judged = judge_divergence(e);
  std::string text;
  const auto row = [&](const char* name, const std::string& value) { text += fmt::format("{:<14}{}\n", name, value); };
  row("compared", fmt::format("{} of {} estimates, {:.1f} % of {:.1f} s, path {:.2f} m, aligned by {}", e.matches, e.estimates,
                              100.0 * e.coverage, e.duration_s, e.path_length_m, name_of(e.alignment)));
  row("ATE", fmt::format("rmse {}, max {}", length(e.ate_rmse_m), length(e.ate_max_m)));
  if (e.ate_rmse_yaw_m) row("ATE, yaw", fmt::format("rmse {}, aligned by position and heading", length(*e.ate_rmse_yaw_m)));
  row("rotation", fmt::format("rmse {:.3f} deg", e.rotation_rmse_deg));
  row("RTE over 1 m", length(e.rte_1m_m) + (e.rte_1m_percent ? fmt::format(" ({:.3f} %)", *e.rte_1m_percent) : ""));
  row("RTE over 1 s", length(e.rte_1s_m));
  row("end to end", fmt::format("{}, z {}, length {}", length(e.e2e_m), length(e.e2e_z_m), length(e.e2e_length_m)));
  row("estimate", fmt::format("{:.1f} Hz, largest gap {:.3f} s, largest jump {}", e.rate_hz, e.largest_gap_s, length(e.largest_jump_m)));
  row("diverged", fmt::format("{} (error {}, limit {})", judged.diverged ? "YES" : "no", length(judged.error_m), length(judged.limit_m)));
  return text;
}

}  // namespace kilvo::lab
