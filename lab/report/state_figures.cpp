#include <algorithm>
#include <numbers>

#include "lab/report/figures.hpp"
#include "lab/report/thin.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t state_buckets = 600;
constexpr const char* axis_names[] = {"x", "y", "z"};

using Columns = std::vector<std::vector<double>>;

Columns columns_of(const std::vector<StateRow>& states, Eigen::Vector3d StateRow::*member, double scale) {
  Columns columns(3);
  for (const StateRow& row : states)
    for (std::size_t i = 0; i < 3; ++i) columns[i].push_back((row.*member)[static_cast<Eigen::Index>(i)] * scale);
  return columns;
}

Json axis_lines(const std::vector<double>& t, const Columns& columns, int digits) {
  const auto kept = thin(columns, state_buckets);
  Json lines = Json::array();
  for (std::size_t i = 0; i < 3; ++i)
    lines.push_back(line(axis_names[i], axis_names[i], column(t, kept, 3), column(columns[i], kept, digits)));
  return lines;
}

/// Of the truth at the times of the states, by its positions 10 ms before and after, in the estimate's world; empty without truth.
struct TrueVelocity {
  std::vector<double> t;
  Columns v{3};
};

TrueVelocity true_velocity(const TimeBase& time, const std::vector<StateRow>& states, std::span<const StampedPose> truth, const Way& way) {
  TrueVelocity result;
  if (way.pairs.empty() || truth.size() < 2) return result;
  constexpr Duration half = std::chrono::milliseconds(10);
  const SO3 R_EG = align(way.pairs, Alignment::se3).R.inverse();
  std::vector<StampedPose> before, after;
  for (const StateRow& row : states) {
    if (row.t - half < truth.front().t || row.t + half > truth.back().t) continue;
    before.push_back({row.t - half, {}});
    after.push_back({row.t + half, {}});
  }
  if (before.size() < 3) return result;
  const std::vector<PosePair> a = match(before, truth), b = match(after, truth);
  for (std::size_t i = 0, j = 0; i < a.size(); ++i) {  // a hole in the truth may swallow one of a pair
    while (j < b.size() && b[j].t < a[i].t + 2 * half) ++j;
    if (j == b.size() || b[j].t != a[i].t + 2 * half) continue;
    const Eigen::Vector3d v = R_EG * Eigen::Vector3d((b[j].T_G.p - a[i].T_G.p) / to_seconds(2 * half));
    result.t.push_back(time.seconds(a[i].t + half));
    for (std::size_t k = 0; k < 3; ++k) result.v[k].push_back(v[static_cast<Eigen::Index>(k)]);
  }
  return result;
}

Json velocity_figure(const std::vector<double>& t, const std::vector<StateRow>& states, const TrueVelocity& truth) {
  Json out = figure("lines", "velocity", "state", "Velocity",
                    truth.t.empty() ? "Axes of the world." : "Axes of the world; the truth is differentiated over 20 ms.");
  const Columns v = columns_of(states, &StateRow::v, 1);
  const Json estimate = axis_lines(t, v, 4);
  const Json real = truth.t.empty() ? Json::array() : axis_lines(truth.t, truth.v, 4);
  out["panels"] = Json::array();
  for (std::size_t i = 0; i < 3; ++i) {
    Json lines = Json::array();
    if (!real.empty()) {
      lines.push_back(real[i]);
      lines[0]["name"] = std::string("true ") + axis_names[i];
      lines[0]["role"] = "truth";
    }
    lines.push_back(estimate[i]);
    out["panels"].push_back({{"label", axis_names[i]}, {"unit", "m/s"}, {"lines", std::move(lines)}, {"bands", Json::array()}});
  }
  return out;
}

}  // namespace

Figures state_figures(const TimeBase& time, const std::vector<StateRow>& states, std::span<const StampedPose> truth, const Way& way) {
  if (states.size() < 2) return {};
  std::vector<double> t;
  for (const StateRow& row : states) t.push_back(time.seconds(row.t));
  constexpr double milli = 1e3, degrees = 180 / std::numbers::pi;
  Json biases = figure("lines", "biases", "state", "Biases of the IMU", "As estimated; their uncertainty is not written by a run.");
  biases["panels"] = Json::array();
  biases["panels"].push_back({{"label", "gyroscope"},
                              {"unit", "deg/s"},
                              {"lines", axis_lines(t, columns_of(states, &StateRow::bg, degrees), 5)},
                              {"bands", Json::array()}});
  biases["panels"].push_back({{"label", "accelerometer"},
                              {"unit", "mm/s²"},
                              {"lines", axis_lines(t, columns_of(states, &StateRow::ba, milli), 3)},
                              {"bands", Json::array()}});
  return {velocity_figure(t, states, true_velocity(time, states, truth, way)), biases};
}

}  // namespace kilvo::lab
