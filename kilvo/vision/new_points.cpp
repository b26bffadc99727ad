#include "kilvo/vision/new_points.hpp"

#include <cmath>

#include "kilvo/vision/patches.hpp"

namespace kilvo {
namespace {

// Pixels around a new point that its coarser patches need.
constexpr double border = 20;
// Surfaces seen at a flatter angle than this (its sine) are no use.
constexpr double grazing = 0.2;

}  // namespace

bool lay_on_plane(const VoxelMap& map, const Eigen::Vector3d& eye_W, VisualPoint& point) {
  constexpr double near = 0.15;  // m
  const Eigen::Vector3d ray = point.p_W - eye_W;
  return map.visit_planes(point.p_W, [&](const VoxelMap::Match& match) {
    const Eigen::Vector3d n = match.plane->normal.cast<double>();
    const double slope = n.dot(ray);
    if (std::abs(slope) < grazing * ray.norm()) return false;
    const Eigen::Vector3d on_plane = eye_W + ray * (n.dot(match.plane->centre - eye_W) / slope);
    if ((on_plane - point.p_W).norm() > near) return false;
    point.p_W = on_plane;
    point.normal_W = match.plane->normal;
    point.variance = static_cast<float>(match.plane->variance_at(on_plane)) + match.plane->roughness_variance;
    point.node = match.node;
    return true;
  });
}

std::vector<NewPoint> new_points(const VoxelMap& map, const Camera& camera, const SE3& T_CW, const GreyImage& image, const DepthView& depth,
                                 std::span<const Track> tracks, const VisionConfig& config) {
  const CellGrid grid(camera, config.cell);
  const SE3 T_WC = T_CW.inverse();
  std::vector<bool> taken(grid.size(), false);
  for (const Track& t : tracks) taken[grid.of(t.pixel)] = true;
  std::vector<NewPoint> best(grid.size());
  for (const DepthView::Seen& s : depth.seen()) {
    // The middle of a pixel, so that its patch is not interpolated.
    const Eigen::Vector2d pixel(std::round(static_cast<double>(s.pixel.x())), std::round(static_cast<double>(s.pixel.y())));
    if (!camera.sees(pixel, border)) continue;
    const std::size_t cell = grid.of(pixel);
    if (taken[cell]) continue;
    const float corner = corner_of(image, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
    if (static_cast<double>(corner) < config.min_corner || corner <= best[cell].point.corner || !depth.shows(s)) continue;
    const auto ray = camera.unproject(pixel);
    if (!ray) continue;
    NewPoint found;
    found.pixel = pixel;
    found.point.corner = corner;
    found.point.p_W = T_WC * (static_cast<double>(s.depth) * *ray);
    if (!lay_on_plane(map, T_WC.p, found.point)) continue;
    const Eigen::Vector3d n = found.point.normal_W.cast<double>();
    const Eigen::Vector3d facing = n.dot(T_WC.p - found.point.p_W) > 0 ? n : Eigen::Vector3d(-n);
    if (depth.hides(pixel, found.point.p_W, facing, static_cast<double>(s.depth))) continue;
    best[cell] = found;
  }
  std::erase_if(best, [](const NewPoint& p) { return p.point.corner <= 0; });
  return best;
}

}  // namespace kilvo
