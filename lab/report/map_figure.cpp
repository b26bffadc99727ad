#include <algorithm>
#include <cmath>

#include "lab/report/base64.hpp"
#include "lab/report/figures.hpp"
#include "lab/report/thin.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t most_points = 200000;  // 7 to 9 bytes each

struct Box {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(INFINITY), high = Eigen::Vector3f::Constant(-INFINITY);
};

/// Coordinates as 16 bits of the box, little end first: x y z x y z ...
std::string packed_points(const Cloud& map, const std::vector<std::size_t>& kept, const Box& box) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(kept.size() * 6);
  const Eigen::Vector3f size = (box.high - box.low).cwiseMax(1e-6F);
  for (const std::size_t i : kept) {
    const Eigen::Vector3f share = (map.points_W[i] - box.low).cwiseQuotient(size) * 65535.0F;
    for (const float x : share) {
      const auto n = static_cast<std::uint16_t>(std::clamp(std::lround(x), 0L, 65535L));
      bytes.push_back(static_cast<std::uint8_t>(n & 255U));
      bytes.push_back(static_cast<std::uint8_t>(n >> 8U));
    }
  }
  return base64(bytes);
}

std::string packed_rgb(const Cloud& map, const std::vector<std::size_t>& kept) {
  std::vector<std::uint8_t> bytes;
  for (const std::size_t i : kept) bytes.insert(bytes.end(), map.rgb[i].begin(), map.rgb[i].end());
  return base64(bytes);
}

/// Intensities as a byte between their 1st and 99th percentile; nothing when they are all the same.
std::string packed_intensity(const Cloud& map, const std::vector<std::size_t>& kept) {
  std::vector<float> sorted;
  for (const std::size_t i : kept)
    if (std::isfinite(map.intensity[i])) sorted.push_back(map.intensity[i]);
  if (sorted.empty()) return {};
  std::sort(sorted.begin(), sorted.end());
  const float low = sorted[sorted.size() / 100], high = sorted[sorted.size() - 1 - sorted.size() / 100];
  if (!(high > low)) return {};
  std::vector<std::uint8_t> bytes;
  for (const std::size_t i : kept) {
    const float share = (map.intensity[i] - low) / (high - low);
    bytes.push_back(static_cast<std::uint8_t>(255 * (std::isfinite(share) ? std::clamp(share, 0.0F, 1.0F) : 0.0F)));
  }
  return base64(bytes);
}

Json path_line(const char* name, const char* role, const std::vector<TimedPoint>& points) {
  constexpr std::size_t buckets = 400;
  std::vector<std::vector<double>> columns(3);
  std::vector<double> t;
  for (const TimedPoint& point : points) {
    t.push_back(point.t);
    for (std::size_t i = 0; i < 3; ++i) columns[i].push_back(point.p[static_cast<Eigen::Index>(i)]);
  }
  const auto kept = thin(columns, buckets);
  Json out = line(name, role, column(columns[0], kept, 3), column(columns[1], kept, 3));
  out["z"] = column(columns[2], kept, 3);
  out["t"] = column(t, kept, 3);
  return out;
}

Json triple(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Figures map_figures(const TimeBase& time, const RunFiles& run, const Way& way) {
  const Cloud& map = run.map;
  const std::vector<std::size_t> kept = thin_points(map.points_W, most_points);
  if (kept.empty()) return {};
  Box box;
  for (const std::size_t i : kept) {
    box.low = box.low.cwiseMin(map.points_W[i]);
    box.high = box.high.cwiseMax(map.points_W[i]);
  }
  std::string note = std::to_string(kept.size());
  if (kept.size() < map.points_W.size()) note += " of " + std::to_string(map.points_W.size());
  Json out = figure("cloud", "map", "way", "Map",
                    note +
                        " points. Drag to turn, two fingers or the right button to move, pinch or wheel to come closer. Play moves the "
                        "robot along the time axis.");
  out["n"] = kept.size();
  out["low"] = triple(box.low);
  out["high"] = triple(box.high);
  out["xyz"] = packed_points(map, kept, box);
  if (!map.rgb.empty()) out["rgb"] = packed_rgb(map, kept);
  if (!map.intensity.empty()) out["intensity"] = packed_intensity(map, kept);
  out["lines"] = Json::array();
  const auto [estimate, truth] = curves_of(time, way);
  if (!truth.empty()) out["lines"].push_back(path_line("truth", "truth", truth));
  if (!estimate.empty()) out["lines"].push_back(path_line("estimate", "estimate", estimate));
  out["robot"] = playback_of(time, run);
  return {out};
}

}  // namespace kilvo::lab
