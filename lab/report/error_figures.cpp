#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/report/figures.hpp"
#include "lab/report/thin.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t error_buckets = 800;
constexpr double degrees = 180 / std::numbers::pi;
constexpr const char* axis_names[] = {"x", "y", "z"};

/// Errors of a way at each of its matches; sigmas are NaN where none is written within 30 ms.
struct Errors {
  std::vector<double> t, aligned_m, aligned_deg;                  // after alignment by least squares
  std::array<std::vector<double>, 3> p, sigma_p, R_deg, sigma_R;  // since the first match: world axes, m; body axes, degrees
  bool with_sigma = false;
};

const StateRow* state_at(const std::vector<StateRow>& states, Time t) {
  constexpr Duration nearby = std::chrono::milliseconds(30);
  auto after = std::lower_bound(states.begin(), states.end(), t, [](const StateRow& row, Time x) { return row.t < x; });
  if (after != states.begin() && (after == states.end() || t - std::prev(after)->t < after->t - t)) --after;
  if (after == states.end() || std::chrono::abs(after->t - t) > nearby) return nullptr;
  return &*after;
}

Errors errors_of(const TimeBase& time, const Way& way, const std::vector<StateRow>& states) {
  Errors e;
  const SE3 T_GE = align(way.pairs, Alignment::se3);
  const SE3 T_EG = align(way.pairs, Alignment::first).inverse();
  for (const PosePair& pair : way.pairs) {
    e.t.push_back(time.seconds(pair.t));
    e.aligned_m.push_back((pair.T_G.p - T_GE * pair.T_E.p).norm());
    e.aligned_deg.push_back((pair.T_G.R.inverse() * (T_GE.R * pair.T_E.R)).Log().norm() * degrees);
    const SE3 truth = T_EG * pair.T_G;
    const Eigen::Vector3d p = pair.T_E.p - truth.p, R = (truth.R.inverse() * pair.T_E.R).Log() * degrees;
    const StateRow* state = state_at(states, pair.t);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      e.p[i].push_back(p[k]);
      e.R_deg[i].push_back(R[k]);
      e.sigma_p[i].push_back(state != nullptr ? 3 * state->sigma_p[k] : NAN);
      e.sigma_R[i].push_back(state != nullptr ? 3 * state->sigma_R[k] * degrees : NAN);
      e.with_sigma = e.with_sigma || std::isfinite(e.sigma_p[i].back());
    }
  }
  return e;
}

std::vector<double> scaled(std::vector<double> values, double scale) {
  for (double& value : values) value *= scale;
  return values;
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

Json panel(const std::string& label, const char* unit) {
  return {{"label", label}, {"unit", unit}, {"lines", Json::array()}, {"bands", Json::array()}};
}

/// One panel for each axis, with its band of three sigma.
Json axis_panels(const std::vector<double>& t, const std::array<std::vector<double>, 3>& errors,
                 const std::array<std::vector<double>, 3>& bands, const LengthUnit& unit, bool with_sigma) {
  Json panels = Json::array();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::vector<std::vector<double>> columns{scaled(errors[i], unit.scale), scaled(bands[i], unit.scale)};
    const auto kept = thin(columns, error_buckets);
    Json one = panel(axis_names[i], unit.name);
    one["lines"].push_back(
        line(std::string("error ") + axis_names[i], axis_names[i], column(t, kept, 3), column(columns[0], kept, unit.digits)));
    if (with_sigma) one["bands"].push_back(line("3 sigma", axis_names[i], column(t, kept, 3), column(columns[1], kept, unit.digits)));
    panels.push_back(std::move(one));
  }
  return panels;
}

}  // namespace

Figures error_figures(const TimeBase& time, const Way& way, const std::vector<StateRow>& states) {
  if (way.pairs.empty()) return {};
  const Errors e = errors_of(time, way, states);
  const LengthUnit unit = unit_for(largest(e.aligned_m));
  Json size = figure("lines", "error", "error", "Error over time",
                     "Distance from the truth and angle to it, the two laid on each other by least squares.");
  const std::vector<std::vector<double>> columns{scaled(e.aligned_m, unit.scale), e.aligned_deg};
  const auto kept = thin(columns, error_buckets);
  size["panels"] = {panel("position", unit.name), panel("rotation", "deg")};
  size["panels"][0]["lines"].push_back(line("position", "estimate", column(e.t, kept, 3), column(columns[0], kept, unit.digits)));
  size["panels"][1]["lines"].push_back(line("rotation", "estimate", column(e.t, kept, 3), column(columns[1], kept, 5)));

  const std::string band = e.with_sigma ? " The band is three sigma of what the estimator believes." : "";
  double largest_axis = 0;
  for (const auto& axis : e.p) largest_axis = std::max(largest_axis, largest(axis));
  Json position = figure("lines", "error_position", "error", "Position error since the start, by axis",
                         "Axes of the world; the first poses are laid on each other." + band);
  position["panels"] = axis_panels(e.t, e.p, e.sigma_p, unit_for(largest_axis), e.with_sigma);
  Json rotation = figure("lines", "error_rotation", "error", "Rotation error since the start, by axis", "Axes of the IMU." + band);
  rotation["panels"] = axis_panels(e.t, e.R_deg, e.sigma_R, {"deg", 1, 5}, e.with_sigma);
  return {size, position, rotation};
}

}  // namespace kilvo::lab
