// For tests: a textured plane in front of a camera, whose images are a formula.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "kilvo/filter/state.hpp"
#include "kilvo/map/plane.hpp"
#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/pyramid.hpp"

namespace kilvo::tiny {

/// The plane x = 3, seen by a camera that looks along x from near the origin; its texture has no edges sharper than some pixels.
struct Scene {
  double wall = 3.0;    // m
  double contrast = 1;  // 0: blank

  static CameraMount mount() {
    CameraMount m;
    m.width = 320;
    m.height = 240;
    m.fx = m.fy = 300;
    m.cx = 160.3;
    m.cy = 119.2;
    m.distortion = {-0.05, 0.01, 1e-3, -1e-3};
    m.T_imu_camera.p = {0.1, 0.02, -0.03};
    Eigen::Matrix3d R;
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    m.T_imu_camera.R = SO3::nearest(R);
    return m;
  }

  static double grey(double y, double z) {
    return 120 + 30 * std::sin(19 * y + 3 * z) + 30 * std::sin(23 * z - 5 * y + 1) + 15 * std::sin(37 * y + 31 * z + 2);
  }

  /// What the camera of an IMU at T_WI sees, `brightness` times as bright, with noise of this standard deviation.
  GreyImage image(const Camera& camera, const SE3& T_WI, double brightness = 1, double noise = 0, unsigned seed = 1) const {
    const SE3 T_WC = T_WI * mount().T_imu_camera;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    GreyImage out{camera.width(), camera.height(), {}};
    out.pixels.reserve(static_cast<std::size_t>(camera.width() * camera.height()));
    for (int v = 0; v < camera.height(); ++v) {
      for (int u = 0; u < camera.width(); ++u) {
        const Eigen::Vector3d ray = T_WC.R * *camera.unproject({u, v});
        const Eigen::Vector3d hit = T_WC.p + ray * ((wall - T_WC.p.x()) / ray.x());
        const double value = brightness * (120 + contrast * (grey(hit.y(), hit.z()) - 120)) + noise * normal(random);
        out.pixels.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))));
      }
    }
    return out;
  }

  /// LiDAR points on the wall.
  std::vector<Eigen::Vector4f> points() const {
    std::vector<Eigen::Vector4f> out;
    for (double y = -1.6; y < 1.6; y += 0.04) {
      for (double z = -1.3; z < 1.3; z += 0.04) out.emplace_back(wall, y, z, 10);
    }
    return out;
  }

  /// The same as groups of many points each, for a map.
  std::vector<PointGroup> groups() const {
    std::vector<PointGroup> out;
    for (const Eigen::Vector4f& p : points()) {
      PointGroup& g = out.emplace_back();
      g.mean = p.head<3>().cast<double>();
      g.count = 20;
      g.noise = 1e-6 * Eigen::Matrix3d::Identity();
    }
    return out;
  }
};

}  // namespace kilvo::tiny
