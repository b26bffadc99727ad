// A camera: pinhole with radial and tangential distortion, linear response, changing exposure, noise, and motion blur when asked for.
#pragma once

#include <functional>
#include <vector>

#include "kilvo/math/deterministic_sum.hpp"
#include "kilvo/sensors/image.hpp"
#include "lab/simulation/simulator_config.hpp"
#include "lab/simulation/world.hpp"

namespace kilvo::lab {

/// Pixel of a direction in the camera's optical frame (z > 0).
Eigen::Vector2d project(const CameraModel& model, const Eigen::Vector3d& p_C);
/// Unit direction of a pixel; the inverse of project().
Eigen::Vector3d unproject(const CameraModel& model, const Eigen::Vector2d& pixel);

/// Exposure time at `t`, s.
double exposure_at(const CameraModel& model, double t);

class CameraSensor {
 public:
  CameraSensor(const SimulatorConfig& config, const World& world);

  /// Image number `index`, its exposure in the middle at `t` (s). `torso_at(t)`: pose of the torso in the world.
  Image image(std::int64_t index, double t, const std::function<SE3(double)>& torso_at, const Workers& workers) const;

 private:
  PixelRay ray_of(int u, int v, const SO3& R_WC) const;
  void add_light(const SE3& T_WC, int first_row, int last_row, std::vector<Colour>& light) const;
  Colour light_of_edge(const Eigen::Vector3d& origin, const PixelRay& ray) const;
  int samples_of(double t, double exposure, const std::function<SE3(double)>& torso_at) const;
  void expose(std::int64_t index, const Colour& brightness, std::size_t first, const std::vector<Colour>& light, Image& out) const;

  const SimulatorConfig& config_;
  const World& world_;
  std::vector<Eigen::Vector3f> directions_;  // by pixel, rows from the top; one pixel more on each side than the image has
  std::vector<float> gaussian_;              // a table of draws, mean 0 and variance 1
};

}  // namespace kilvo::lab
