#include "lab/report/comparison.hpp"

#include <cmath>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "lab/evaluation/trajectory_file.hpp"

namespace kilvo::lab {
namespace {

std::string name_of_run(const std::filesystem::path& run) {
  const std::filesystem::path plain = run.lexically_normal();
  return (plain.has_filename() ? plain : plain.parent_path()).string();
}

ComparedRun compared(const std::string& run, std::span<const StampedPose> truth, Alignment alignment) {
  ComparedRun out;
  out.name = name_of_run(run);
  const std::vector<StampedPose> estimate = trajectory_of_run(run);
  out.errors = evaluate(estimate, truth, alignment);
  const std::vector<PosePair> pairs = match(estimate, truth);
  const SE3 T_GE = align(pairs, alignment);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d p = T_GE * pair.T_E.p, error = p - pair.T_G.p;
    squares += error.cwiseAbs2();
    out.t.push_back(to_seconds(pair.t - truth.front().t));
    out.p.push_back(p);
    out.error_m.push_back(error.norm());
  }
  const Eigen::Vector3d rms = (squares / static_cast<double>(pairs.size())).cwiseSqrt();
  out.axis_rmse_m = {rms.x(), rms.y(), rms.z()};
  return out;
}

using Row = std::vector<std::string>;

std::string millimetres(double metres) { return fmt::format("{:.2f}", 1e3 * metres); }
std::string millimetres(const std::optional<double>& metres) { return metres ? millimetres(*metres) : "-"; }

std::vector<Row> table_of(const Comparison& comparison) {
  std::vector<Row> rows{
      {"run", "ATE mm", "max mm", "x mm", "y mm", "z mm", "rotation deg", "RPE 1 m mm", "RPE 1 s mm", "end mm", "cover %", "diverged"}};
  for (const ComparedRun& run : comparison.runs) {
    const Evaluation& e = run.errors;
    rows.push_back({run.name, millimetres(e.ate_rmse_m), millimetres(e.ate_max_m), millimetres(run.axis_rmse_m[0]),
                    millimetres(run.axis_rmse_m[1]), millimetres(run.axis_rmse_m[2]), fmt::format("{:.3f}", e.rotation_rmse_deg),
                    millimetres(e.rte_1m_m), millimetres(e.rte_1s_m), millimetres(e.e2e_m), fmt::format("{:.1f}", 100 * e.coverage),
                    judge_divergence(e).diverged ? "YES" : "no"});
  }
  return rows;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

constexpr const char* colours[] = {"#1463c6", "#d9711c", "#2b8a57", "#8a4fb8", "#cc3d4e", "#2f8f9d"};

struct Curve {
  std::string colour;
  std::vector<double> x, y;
};

Curve curve_of(const std::string& colour, const std::vector<Eigen::Vector3d>& points, Eigen::Index across, Eigen::Index up) {
  Curve out{colour, {}, {}};
  const std::size_t step = points.size() / 1500 + 1;
  for (std::size_t i = 0; i < points.size(); i += step) {
    out.x.push_back(points[i][across]);
    out.y.push_back(points[i][up]);
  }
  return out;
}

/// Lines in a frame with its least and greatest values; `equal`: one metre is as long along both axes.
std::string plot(const std::string& title, const std::vector<Curve>& curves, bool equal) {
  constexpr double width = 1000, height = 420, left = 60, bottom = 30;
  double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY;
  for (const Curve& curve : curves) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      x0 = std::min(x0, curve.x[i]), x1 = std::max(x1, curve.x[i]);
      y0 = std::min(y0, curve.y[i]), y1 = std::max(y1, curve.y[i]);
    }
  }
  double sx = (width - left - 10) / std::max(x1 - x0, 1e-9), sy = (height - bottom - 10) / std::max(y1 - y0, 1e-9);
  if (equal) sx = sy = std::min(sx, sy);
  std::string out = fmt::format("<h2>{}</h2><svg viewBox='0 0 {} {}' role='img'>", escaped(title), width, height);
  for (const Curve& curve : curves) {
    out += fmt::format("<polyline fill='none' stroke='{}' stroke-width='1.6' points='", curve.colour);
    for (std::size_t i = 0; i < curve.x.size(); ++i)
      out += fmt::format("{:.1f},{:.1f} ", left + sx * (curve.x[i] - x0), height - bottom - sy * (curve.y[i] - y0));
    out += "'/>";
  }
  out += fmt::format("<text x='{}' y='{}'>{:.3g}</text><text x='{}' y='{}' text-anchor='end'>{:.3g}</text>", left, height - 8, x0,
                     left + sx * (x1 - x0), height - 8, x1);
  out += fmt::format("<text x='{}' y='{}' text-anchor='end'>{:.3g}</text><text x='{}' y='{}' text-anchor='end'>{:.3g}</text></svg>",
                     left - 6, height - bottom, y0, left - 6, height - bottom - sy * (y1 - y0) + 12, y1);
  return out;
}

constexpr const char* head =
    R"(<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>KILVO: comparison of runs</title><style>
body{margin:0 auto;max-width:1120px;padding:20px;font:15px/1.5 system-ui,"DejaVu Sans",sans-serif;color:#1b1f24;background:#fbfbfa}
h2{font-size:17px;margin:28px 0 6px}svg{width:100%;background:#fff;border:1px solid #e4e6e8;border-radius:8px}svg text{font-size:12px;fill:#667079}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:13.5px}th,td{padding:4px 12px 4px 0;text-align:right;white-space:nowrap}
th:first-child,td:first-child{text-align:left}.key{display:inline-block;width:14px;border-top:3px solid;margin-right:6px;vertical-align:4px}
</style></head><body><h1>Comparison of runs</h1>)";

std::string html_table(const Comparison& comparison) {
  const std::vector<Row> rows = table_of(comparison);
  std::string out = "<div class='scroll'><table>";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    out += "<tr>";
    for (std::size_t k = 0; k < rows[i].size(); ++k) {
      const std::string key =
          i > 0 && k == 0 ? fmt::format("<span class='key' style='color:{}'></span>", colours[(i - 1) % std::size(colours)]) : "";
      out += fmt::format("<{0}>{1}{2}</{0}>", i == 0 ? "th" : "td", key, escaped(rows[i][k]));
    }
    out += "</tr>";
  }
  return out + "</table></div>";
}

}  // namespace

std::vector<StampedPose> trajectory_of_run(const std::filesystem::path& run) {
  std::error_code error;
  if (!std::filesystem::is_directory(run, error)) return read_tum(run);
  if (std::filesystem::exists(run / "sweeps.tum", error)) {
    std::vector<StampedPose> sweeps = read_tum(run / "sweeps.tum");
    if (!sweeps.empty()) return sweeps;
  }
  return read_tum(run / "odometry.tum");
}

Comparison compare_runs(std::span<const std::string> runs, const std::filesystem::path& truth, Alignment alignment) {
  Comparison out;
  const std::vector<StampedPose> poses = read_tum(truth);
  for (const std::string& run : runs) {
    try {
      out.runs.push_back(compared(run, poses, alignment));
    } catch (const EvaluationError& e) {
      throw EvaluationError(fmt::format("{}: {}", run, e.what()));
    }
  }
  for (const StampedPose& pose : poses) out.truth.push_back(pose.T.p);
  return out;
}

std::string to_text(const Comparison& comparison) {
  const std::vector<Row> rows = table_of(comparison);
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const Row& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  std::string out;
  for (const Row& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k)
      out += k == 0 ? fmt::format("{:<{}}", row[k], widths[k]) : fmt::format("  {:>{}}", row[k], widths[k]);
    out += "\n";
  }
  return out + fmt::format("aligned by {}\n", comparison.runs.empty() ? "-" : name_of(comparison.runs.front().errors.alignment));
}

std::string to_json(const Comparison& comparison) {
  nlohmann::ordered_json json{{"align", comparison.runs.empty() ? "" : name_of(comparison.runs.front().errors.alignment)},
                              {"runs", nlohmann::ordered_json::array()}};
  for (const ComparedRun& run : comparison.runs) {
    nlohmann::ordered_json one{{"run", run.name}};
    one.update(nlohmann::ordered_json::parse(to_json(run.errors)));
    one["axis_rmse_m"] = run.axis_rmse_m;
    json["runs"].push_back(one);
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string to_html(const Comparison& comparison) {
  std::vector<Curve> above{curve_of("#9aa1a8", comparison.truth, 0, 1)}, side{curve_of("#9aa1a8", comparison.truth, 0, 2)}, errors;
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    const ComparedRun& run = comparison.runs[i];
    const std::string colour = colours[i % std::size(colours)];
    above.push_back(curve_of(colour, run.p, 0, 1));
    side.push_back(curve_of(colour, run.p, 0, 2));
    Curve error{colour, {}, {}};
    for (std::size_t k = 0; k < run.t.size(); k += run.t.size() / 1500 + 1) {
      error.x.push_back(run.t[k]);
      error.y.push_back(1e3 * run.error_m[k]);
    }
    errors.push_back(std::move(error));
  }
  return head + html_table(comparison) +
         fmt::format("<p>Aligned by {}; the truth is grey. Errors are of the position.</p>",
                     comparison.runs.empty() ? "-" : name_of(comparison.runs.front().errors.alignment)) +
         plot("From above: x, y (m)", above, true) + plot("From the side: x, z (m)", side, false) +
         plot("Error over time: s, mm", errors, false) + "</body></html>\n";
}

}  // namespace kilvo::lab
