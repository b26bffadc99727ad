// Small pieces of images: cut, judged, and turned into what another view should show.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "kilvo/map/visual_map.hpp"
#include "kilvo/vision/pyramid.hpp"

namespace kilvo {

/// The levels around a pixel of level 0. Levels that would reach outside the image are left out; none at all when level 0 does.
std::optional<Patch> cut_patch(std::span<const GreyImage> pyramid, const Eigen::Vector2d& pixel);

/// Smaller eigenvalue of the scatter of the gradient in the 8x8 pixels around one, per pixel (Shi and Tomasi 1994); 0 near the border.
float corner_of(const GreyImage& image, int x, int y);

/// What a view of a patch should look like at one level: values, and their gradient by the pixel of that level, at 8x8 pixels.
struct Template {
  static constexpr int size = 8;
  static constexpr int count = size * size;

  std::array<float, count> value, dx, dy;
};

/// Pixels of the finest level that a patch of this one needs on each side, one for the interpolation included.
constexpr double border_at(int level) { return (Template::size / 2 + 1) << level; }

/// How the picture of a plane changes between two views, about a point of it: what is d pixels beside the point in one view is
/// A d / (1 + c'd) beside it in the other, both of level 0. Without c, patches of a wall along which a robot walks seem to move too far.
struct PlaneWarp {
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  Eigen::Vector2d c = Eigen::Vector2d::Zero();  // 1/px
};

/// The patch as a view should show it, at a level of the view; from the level of the patch that is nearest in scale. None when the scales
/// do not fit, or the patch is too small.
std::optional<Template> warp(const Observation& from, const PlaneWarp& plane, int level);

/// The 8x8 pixels of a view around a pixel of its own level, which must be at least 5 px within.
void sample_patch(const GreyImage& image, const Eigen::Vector2f& centre, std::array<float, Template::count>& out);

/// Correlation of two patches, each less its mean; 0 when one is flat.
float correlation(const std::array<float, Template::count>& a, const std::array<float, Template::count>& b);

}  // namespace kilvo
