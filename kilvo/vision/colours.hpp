// The colours that an image gives to the points it sees.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/image.hpp"
#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/depth_view.hpp"

namespace kilvo {

/// The colour of a point of the map in an image.
struct ColouredPoint {
  Eigen::Vector3f p_W;              // m
  std::array<std::uint8_t, 3> rgb;  // as the first image, with its exposure, would have shown it
  float weight;                     // how well it was seen; only ratios matter
};

/// Of the view's points those that nothing hides, where the pose T_CW sees them. `image` is of the camera's size; `tau`: its inverse
/// exposure, relative to the first image.
std::vector<ColouredPoint> colours_of(const Image& image, double tau, const Camera& camera, const SE3& T_CW, const DepthView& view);

}  // namespace kilvo
