// LiDAR points as the camera sees them: which surfaces are in view, and what stands in front of what.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "kilvo/map/voxel_index.hpp"
#include "kilvo/math/se3.hpp"
#include "kilvo/vision/camera.hpp"

namespace kilvo {

class DepthView {
 public:
  struct Seen {
    std::uint32_t index = 0;  // in points_W
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
    float depth = 0;  // along the optical axis, m
  };

  /// Keeps a reference: the points (x, y, z, intensity; world, m) must outlive it.
  DepthView(const Camera& camera, const SE3& T_CW, std::span<const Eigen::Vector4f> points_W);

  /// The points in the image, hidden ones as well.
  const std::vector<Seen>& seen() const { return seen_; }
  Eigen::Vector3d point(const Seen& s) const { return points_W_[s.index].head<3>().cast<double>(); }

  /// Whether something around the pixel stands in front of the plane through p_W with the normal n_W that faces the camera.
  bool hides(const Eigen::Vector2d& pixel, const Eigen::Vector3d& p_W, const Eigen::Vector3d& n_W, double depth) const;

  /// Whether a point is what the camera sees at its pixel: nothing around it is clearly nearer.
  bool shows(const Seen& s) const;

 private:
  static constexpr int cell = 8;  // px
  void find_fronts();
  float front(const Eigen::Vector2f& pixel) const {
    return fronts_[static_cast<std::size_t>(static_cast<int>(pixel.y()) / cell * columns_ + static_cast<int>(pixel.x()) / cell)];
  }

  std::span<const Eigen::Vector4f> points_W_;
  std::vector<Seen> seen_;
  int columns_, rows_;
  std::vector<std::uint32_t> nearest_;  // by cell: of seen_
  std::vector<float> fronts_;           // by cell: the least depth in it and around it
};

}  // namespace kilvo
