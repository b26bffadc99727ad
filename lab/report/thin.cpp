#include "lab/report/thin.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_set>

namespace kilvo::lab {
namespace {

/// The first point of each voxel, or as many as `limit` and one more.
std::vector<std::size_t> one_per_voxel(std::span<const Eigen::Vector3f> points, const std::vector<std::size_t>& usable, float size,
                                       std::size_t limit) {
  constexpr std::uint64_t mask = (1U << 21U) - 1;
  std::unordered_set<std::uint64_t> voxels;
  std::vector<std::size_t> kept;
  for (const std::size_t i : usable) {
    std::uint64_t key = 0;
    for (const float x : points[i]) key = key << 21U | (static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / size))) & mask);
    if (voxels.insert(key).second) kept.push_back(i);
    if (kept.size() > limit) break;
  }
  return kept;
}

void append_extremes(const std::vector<double>& column, std::size_t begin, std::size_t end, std::vector<std::size_t>& kept) {
  std::optional<std::size_t> least, greatest, hole;
  for (std::size_t i = begin; i < end; ++i) {
    if (std::isnan(column[i])) {
      if (!hole) hole = i;
      continue;
    }
    if (!least || column[i] < column[*least]) least = i;
    if (!greatest || column[i] > column[*greatest]) greatest = i;
  }
  for (const auto& found : {least, greatest, hole})
    if (found) kept.push_back(*found);
}

}  // namespace

std::vector<std::size_t> thin(std::span<const std::vector<double>> columns, std::size_t buckets) {
  std::vector<std::size_t> kept;
  if (columns.empty() || columns.front().empty()) return kept;
  const std::size_t rows = columns.front().size();
  buckets = std::min(std::max<std::size_t>(buckets, 1), rows);
  for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
    const std::size_t begin = bucket * rows / buckets, end = (bucket + 1) * rows / buckets;
    kept.push_back(begin);
    for (const std::vector<double>& column : columns) append_extremes(column, begin, end, kept);
  }
  kept.push_back(rows - 1);
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

std::vector<std::size_t> thin_points(std::span<const Eigen::Vector3f> points, std::size_t limit) {
  std::vector<std::size_t> usable;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(INFINITY), high = -low;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) continue;
    usable.push_back(i);
    low = low.cwiseMin(points[i]);
    high = high.cwiseMax(points[i]);
  }
  if (usable.size() <= limit) return usable;
  // The points lie on surfaces: their number goes with the inverse square of the voxels' size.
  constexpr float smallest_share = 1e-6F, growth = 1.15F;
  float size = std::max((high - low).norm() / std::sqrt(static_cast<float>(limit)) / 4, smallest_share * (high - low).norm());
  if (!(size > 0) || !std::isfinite(size)) return {usable.begin(), usable.begin() + static_cast<std::ptrdiff_t>(limit)};
  std::vector<std::size_t> kept = one_per_voxel(points, usable, size, limit);
  while (kept.size() > limit) {
    size *= growth;
    kept = one_per_voxel(points, usable, size, limit);
  }
  return kept;
}

}  // namespace kilvo::lab
