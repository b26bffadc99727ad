#include "kilvo/vision/depth_view.hpp"

#include <algorithm>
#include <limits>

namespace kilvo {
namespace {

// In front: by more than the LiDAR's noise and what a grazing plane bends.
constexpr double in_front_share = 0.02, in_front_least = 0.08;  // of the depth; m
// Nearer than this the camera sees blur and the robot itself.
constexpr float least_depth = 0.2F;  // m

// False: the image cannot show it. So most points need no distortion.
bool may_hold(const Camera::Window& window, const Eigen::Vector3f& p) {
  return p.x() >= window.left * p.z() && p.x() <= window.right * p.z() && p.y() >= window.top * p.z() && p.y() <= window.bottom * p.z();
}

}  // namespace

DepthView::DepthView(const Camera& camera, const SE3& T_CW, std::span<const Eigen::Vector4f> points_W)
    : points_W_(points_W),
      columns_(camera.width() / cell + 1),
      rows_(camera.height() / cell + 1),
      nearest_(static_cast<std::size_t>(columns_ * rows_), no_index) {
  const Eigen::Matrix3f R = T_CW.R.matrix().cast<float>();
  const Eigen::Vector3f t = T_CW.p.cast<float>();
  for (std::uint32_t i = 0; i < points_W.size(); ++i) {
    const Eigen::Vector3f p_C = R * points_W[i].head<3>() + t;
    if (p_C.z() < least_depth || !may_hold(camera.window(), p_C)) continue;
    const auto pixel = camera.project(p_C.cast<double>());
    if (!pixel || !camera.sees(*pixel, 0)) continue;
    const auto at = static_cast<std::size_t>(static_cast<int>(pixel->y()) / cell * columns_ + static_cast<int>(pixel->x()) / cell);
    std::uint32_t& nearest = nearest_[at];
    if (nearest == no_index || p_C.z() < seen_[nearest].depth) nearest = static_cast<std::uint32_t>(seen_.size());
    seen_.push_back({i, pixel->cast<float>(), p_C.z()});
  }
  find_fronts();
}

void DepthView::find_fronts() {
  const auto columns = static_cast<std::size_t>(columns_), rows = static_cast<std::size_t>(rows_);
  const std::size_t wide = columns + 2;  // with a border
  std::vector<float> own(wide * (rows + 2), std::numeric_limits<float>::infinity()), across(own);
  for (std::size_t y = 0; y < rows; ++y) {
    for (std::size_t x = 0; x < columns; ++x) {
      const std::uint32_t nearest = nearest_[y * columns + x];
      if (nearest != no_index) own[(y + 1) * wide + x + 1] = seen_[nearest].depth;
    }
  }
  for (std::size_t i = 1; i + 1 < own.size(); ++i) across[i] = std::min(own[i], std::min(own[i - 1], own[i + 1]));
  fronts_.resize(columns * rows);
  for (std::size_t y = 0; y < rows; ++y) {
    const float* here = across.data() + (y + 1) * wide + 1;
    for (std::size_t x = 0; x < columns; ++x) fronts_[y * columns + x] = std::min(here[x], std::min(here[x - wide], here[x + wide]));
  }
}

bool DepthView::hides(const Eigen::Vector2d& pixel, const Eigen::Vector3d& p_W, const Eigen::Vector3d& n_W, double depth) const {
  if (static_cast<double>(front(pixel.cast<float>())) >= depth) return false;
  const double limit = in_front_least + in_front_share * depth;
  const int x = static_cast<int>(pixel.x()) / cell, y = static_cast<int>(pixel.y()) / cell;
  for (int j = std::max(0, y - 1); j <= std::min(rows_ - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(columns_ - 1, x + 1); ++i) {
      const std::uint32_t nearest = nearest_[static_cast<std::size_t>(j * columns_ + i)];
      if (nearest == no_index || static_cast<double>(seen_[nearest].depth) >= depth) continue;
      if (n_W.dot(point(seen_[nearest]) - p_W) > limit) return true;
    }
  }
  return false;
}

bool DepthView::shows(const Seen& s) const {
  constexpr float share = 0.1F;
  const float limit = s.depth * (1 - share) - static_cast<float>(in_front_least);
  return front(s.pixel) >= limit;
}

}  // namespace kilvo
