#include <algorithm>
#include <cmath>

#include "lab/report/figures.hpp"
#include "lab/report/thin.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t path_buckets = 1000;
constexpr Duration even_period = std::chrono::milliseconds(50);

struct PathCurve {
  std::vector<double> t, x, y;
};

Json curve_line(const char* name, const char* role, const PathCurve& curve) {
  const auto kept = thin(std::vector{curve.x, curve.y}, path_buckets);
  Json out = line(name, role, column(curve.x, kept, 4), column(curve.y, kept, 4));
  out["t"] = column(curve.t, kept, 3);
  return out;
}

double extent(const std::vector<TimedPoint>& points, Eigen::Index axis) {
  const auto [least, greatest] =
      std::minmax_element(points.begin(), points.end(), [&](const auto& a, const auto& b) { return a.p[axis] < b.p[axis]; });
  return greatest->p[axis] - least->p[axis];
}

Json plane(const char* id, const char* title, const char* note, const std::vector<TimedPoint>& estimate,
           const std::vector<TimedPoint>& truth, Eigen::Index across, Eigen::Index up) {
  constexpr const char* names[] = {"x", "y", "z"};
  Json out = figure("plane", id, "way", title, note);
  out["x_label"] = names[across];
  out["y_label"] = names[up];
  out["equal"] = up != 2;
  out["lines"] = Json::array();
  for (const auto& [points, name, role] : {std::tuple(&truth, "truth", "truth"), std::tuple(&estimate, "estimate", "estimate")}) {
    PathCurve curve;
    for (const TimedPoint& point : *points) {
      curve.t.push_back(point.t);
      curve.x.push_back(point.p[across]);
      curve.y.push_back(point.p[up]);
    }
    if (!points->empty()) out["lines"].push_back(curve_line(name, role, curve));
  }
  return out;
}

/// Appends the odometry after what is there already and before `end`, at 20 Hz.
void bridge(std::span<const StampedPose> odometry, Time end, std::size_t& next, std::vector<StampedPose>& poses) {
  for (; next < odometry.size() && odometry[next].t < end; ++next) {
    const bool far_from_last = poses.empty() || odometry[next].t - poses.back().t >= even_period;
    if (far_from_last && end - odometry[next].t >= even_period / 2) poses.push_back(odometry[next]);
  }
}

Way without_truth(const RunFiles& run) {
  constexpr Duration hole = std::chrono::milliseconds(250);
  constexpr double enough = 0.98;
  Way way;
  if (run.odometry.empty()) return way;
  std::size_t next = 0;
  Duration in_holes{0};
  const Time after_all = run.odometry.back().t + even_period;
  const auto reach = [&](Time t) {
    const Time last = way.poses.empty() ? run.odometry.front().t : way.poses.back().t;
    if (t - last <= hole) return;
    if (!way.poses.empty()) in_holes += t - last;
    bridge(run.odometry, t, next, way.poses);
  };
  for (const StampedPose& sweep : run.sweeps) {
    reach(sweep.t);
    way.poses.push_back(sweep);
  }
  reach(after_all);
  const Duration whole = run.sweeps.empty() ? Duration{0} : run.odometry.back().t - run.sweeps.front().t;
  way.of_sweeps = run.sweeps.size() >= 3 && to_seconds(in_holes) <= (1 - enough) * to_seconds(whole);
  return way;
}

}  // namespace

Way way_of(const RunFiles& run) { return without_truth(run); }

Way way_of(const RunFiles& run, std::span<const StampedPose> truth) {
  Way way = without_truth(run);
  way.pairs = match(way.poses, truth);
  way.evaluation = evaluate(way.of_sweeps ? run.sweeps : run.odometry, truth, Alignment::se3);
  return way;
}

Curves curves_of(const TimeBase& time, const Way& way) {
  Curves curves;
  for (const StampedPose& pose : way.poses) curves.estimate.push_back({time.seconds(pose.t), pose.T.p});
  if (way.pairs.empty()) return curves;
  const SE3 T_EG = align(way.pairs, Alignment::se3).inverse();
  for (const PosePair& pair : way.pairs) curves.truth.push_back({time.seconds(pair.t), T_EG * pair.T_G.p});
  return curves;
}

Figures path_figures(const TimeBase& time, const Way& way) {
  if (way.poses.size() < 2) return {};
  const auto [estimate, truth] = curves_of(time, way);
  const Eigen::Index across = extent(estimate, 0) >= extent(estimate, 1) ? 0 : 1;
  const char* laid =
      truth.empty() ? "In the world of the estimate." : "In the world of the estimate; the truth is laid on it by least squares.";
  return {plane("path_top", "From above", laid, estimate, truth, 0, 1),
          plane("path_side", "From the side", "Height is drawn at a scale of its own.", estimate, truth, across, 2)};
}

}  // namespace kilvo::lab
