#include "kilvo/vision/new_points.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "kilvo/vision/patches.hpp"

namespace kilvo {
namespace {

// Surfaces seen at a flatter angle than this (its sine) are no use.
constexpr double grazing_new = 0.2;

// Looks for new points of one image.
struct Search {
  const VoxelMap& map;
  const Camera& camera;
  const GreyImage& image;
  const DepthView& depth;
  SE3 T_WC;

  // The point of the map that is seen at a pixel near a LiDAR point.
  std::optional<NewPoint> at(const Eigen::Vector2d& pixel, const DepthView::Seen& s, float corner) const {
    if (!depth.shows(s)) return std::nullopt;
    const auto ray = camera.unproject(pixel);
    if (!ray) return std::nullopt;
    NewPoint found;
    found.pixel = pixel;
    found.point.corner = corner;
    found.point.p_W = T_WC * (static_cast<double>(s.depth) * *ray);
    if (!project_to_plane(map, T_WC.p, found.point)) return std::nullopt;
    const Eigen::Vector3d n = found.point.normal_W.cast<double>();
    const Eigen::Vector3d facing = n.dot(T_WC.p - found.point.p_W) > 0 ? n : Eigen::Vector3d(-n);
    if (depth.hides(pixel, found.point.p_W, facing, static_cast<double>(s.depth))) return std::nullopt;
    return found;
  }

  // Equally bright all around, also when it is seen a little beside its place.
  bool is_even(const Eigen::Vector2d& pixel) const {
    constexpr int most = 3;  // grey levels
    const int reach = Template::size;
    int low = 255, high = 0;
    for (const int dy : {-reach, 0}) {
      for (const int dx : {-reach, 0}) {
        int sum = 0;
        for (int y = 0; y < reach; ++y) {
          const std::uint8_t* row = image.row(static_cast<int>(pixel.y()) + dy + y) + static_cast<int>(pixel.x()) + dx;
          for (int x = 0; x < reach; ++x) sum += row[x];
        }
        low = std::min(low, sum / (reach * reach));
        high = std::max(high, sum / (reach * reach));
      }
    }
    return high - low <= most;
  }
};

// The middle of a pixel, so that its patch is not interpolated.
Eigen::Vector2d pixel_of(const DepthView::Seen& s) {
  return {std::round(static_cast<double>(s.pixel.x())), std::round(static_cast<double>(s.pixel.y()))};
}

// One even patch in each block of the image that has nothing else.
void add_plain(const Search& search, int block, std::span<const PatchCandidate> tracks, std::vector<NewPoint>& out) {
  constexpr float some = 1e-3F;  // of a corner
  const CellGrid blocks(search.camera, block);
  std::vector<bool> taken(blocks.size(), false);
  for (const PatchCandidate& t : tracks) taken[blocks.of(t.pixel)] = true;
  for (const NewPoint& p : out) taken[blocks.of(p.pixel)] = true;
  for (const DepthView::Seen& s : search.depth.seen()) {
    const Eigen::Vector2d pixel = pixel_of(s);
    if (!search.camera.sees(pixel, border_at(2)) || taken[blocks.of(pixel)] || !search.is_even(pixel)) continue;
    const auto found = search.at(pixel, s, some);
    if (!found) continue;
    taken[blocks.of(pixel)] = true;
    out.push_back(*found);
  }
}

}  // namespace

bool project_to_plane(const VoxelMap& map, const Eigen::Vector3d& eye_W, VisualPoint& point) {
  constexpr double near = 0.15;  // m
  const Eigen::Vector3d ray = point.p_W - eye_W;
  return map.visit_planes(point.p_W, [&](const VoxelMap::Match& match) {
    const Eigen::Vector3d n = match.plane->normal.cast<double>();
    const double slope = n.dot(ray);
    if (std::abs(slope) < grazing_new * ray.norm()) return false;
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
                                 std::span<const PatchCandidate> tracks, const VisionConfig& config) {
  const CellGrid grid(camera, config.cell);
  const Search search{map, camera, image, depth, T_CW.inverse()};
  std::vector<bool> taken(grid.size(), false);
  for (const PatchCandidate& t : tracks) taken[grid.of(t.pixel)] = true;
  std::vector<NewPoint> best(grid.size());
  for (const DepthView::Seen& s : depth.seen()) {
    const Eigen::Vector2d pixel = pixel_of(s);
    if (!camera.sees(pixel, border_at(2))) continue;
    const std::size_t cell = grid.of(pixel);
    if (taken[cell]) continue;
    const float corner = corner_of(image, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
    if (static_cast<double>(corner) < config.min_corner || corner <= best[cell].point.corner) continue;
    if (const auto found = search.at(pixel, s, corner)) best[cell] = *found;
  }
  std::erase_if(best, [](const NewPoint& p) { return p.point.corner <= 0; });
  constexpr int columns = 5;  // of blocks
  const auto corners = static_cast<std::size_t>(std::ranges::count_if(tracks, [](const PatchCandidate& t) { return !t.plain; }));
  if (corners + best.size() < plenty_of_corners) add_plain(search, camera.width() / columns, tracks, best);
  return best;
}

}  // namespace kilvo
