// Which points of the visual map an image should be held against: one in each cell of the image, not hidden, seen from a similar view.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "kilvo/map/visual_map.hpp"
#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/depth_view.hpp"
#include "kilvo/vision/patches.hpp"
#include "kilvo/vision/vision_config.hpp"

namespace kilvo {

struct PatchCandidate {
  std::uint32_t point = 0;
  std::uint32_t observation = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // where it is expected
  PlaneWarp warp;                                   // from this image to the observation's
  bool plain = false;                               // without corners: its brightness measures the exposure only
  double view_angle = 0;                            // between the two views of the point, rad
};

/// The grid of cells of the image.
class CellGrid {
 public:
  CellGrid(const Camera& camera, int cell)
      : cell_(cell), columns_((camera.width() + cell - 1) / cell), rows_((camera.height() + cell - 1) / cell) {}
  std::size_t size() const { return static_cast<std::size_t>(columns_ * rows_); }
  std::size_t of(const Eigen::Vector2d& pixel) const {
    return static_cast<std::size_t>(static_cast<int>(pixel.y()) / cell_ * columns_ + static_cast<int>(pixel.x()) / cell_);
  }

 private:
  int cell_, columns_, rows_;
};

/// So many corners determine the exposure alone.
inline constexpr std::size_t enough_corners = 8;
/// With more of them plain patches are neither begun nor looked at.
inline constexpr std::size_t plenty_of_corners = 24;

/// Surfaces seen at a flatter angle than this (its sine) are not used.
inline constexpr double grazing = 0.12;
/// Views of a point that differ by less are alike, and one that differs by more is kept as another one: octaves of scale, rad.
inline constexpr double alike_scale = 0.4, alike_angle = 0.25;

/// What the camera at T_CW should see of the map.
std::vector<PatchCandidate> select_patches(const VisualMap& map, const Camera& camera, const SE3& T_CW, const DepthView& depth,
                                           const VisionConfig& config);

/// How the plane through p_W with normal n_W maps from the image at T_CW to that at T_RW, about the point. None where one does not see it.
std::optional<PlaneWarp> warp_between(const Camera& camera, const SE3& T_CW, const SE3& T_RW, const Eigen::Vector3d& p_W,
                                      const Eigen::Vector3d& n_W);

}  // namespace kilvo
