// Pinhole cameras with radial-tangential (Brown 1966) or equidistant (Kannala and Brandt 2006) distortion. Optical frame: z forward, x
// right, y down; pixels: (0, 0) is the middle of the upper left one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class Camera {
 public:
  /// Throws std::invalid_argument when the mount's model or its numbers are invalid.
  explicit Camera(const CameraMount& mount);

  int width() const { return width_; }
  int height() const { return height_; }

  /// Where a point is seen, px; none behind the camera, or where the distortion's polynomial has turned back. It may lie outside the image.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C) const;

  /// The same, with its derivative by the point, px/m.
  struct Projection {
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> J;
  };
  std::optional<Projection> project_with_jacobian(const Eigen::Vector3d& p_C) const;

  /// The direction that a pixel looks along, of z = 1; none where no direction projects there.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;

  /// Bounds of x/z and y/z of what the image can hold.
  struct Window {
    float left = 0, right = 0, top = 0, bottom = 0;
  };
  const Window& window() const { return window_; }

  /// Whether the pixel and `border` around it lie in the image.
  bool sees(const Eigen::Vector2d& pixel, double border) const {
    return pixel.x() >= border && pixel.y() >= border && pixel.x() <= width_ - 1 - border && pixel.y() <= height_ - 1 - border;
  }

 private:
  Window find_window() const;

  bool fisheye_ = false;
  int width_ = 0, height_ = 0;
  double fx_ = 0, fy_ = 0, cx_ = 0, cy_ = 0;
  std::array<double, 5> k_{};  // k1 k2 p1 p2 k3, or k1 k2 k3 k4
  Window window_;
  double largest_ = 0;  // of the undistorted radius (radtan) or angle (fisheye), beyond which the polynomial turns back
};

}  // namespace kilvo
