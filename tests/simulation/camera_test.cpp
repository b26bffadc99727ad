// Is the camera in the configuration that a simulation writes the camera that took the pictures?
#include <array>
#include <cmath>
#include <gtest/gtest.h>

#include "lab/settings/settings.hpp"
#include "lab/simulation/camera_sensor.hpp"
#include "lab/simulation/description.hpp"

namespace kilvo {
namespace camera_test {

/// The usual model, written once more: pinhole with radial and tangential distortion.
Eigen::Vector2d pixel_of(const CameraMount& camera, const SE3& T_WI, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d p = (T_WI * camera.T_imu_camera).inverse() * p_W;
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const double k1 = camera.distortion[0], k2 = camera.distortion[1], p1 = camera.distortion[2], p2 = camera.distortion[3];
  const double radial = 1 + k1 * r2 + k2 * r2 * r2;
  return {camera.fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + camera.cx,
          camera.fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + camera.cy};
}

/// Bright squares before a dark sky.
lab::Scene squares() {
  lab::Scene scene;
  scene.sky = {0.05F, 0.05F, 0.05F};
  const std::size_t white = scene.add({lab::Pattern::plain, {0.8F, 0.8F, 0.8F}, {0.8F, 0.8F, 0.8F}});
  for (const double y : {-1.2, -0.4, 0.4, 1.2}) {
    for (const double z : {-0.3, 0.4, 1.0}) {
      const double x = 2 + 0.3 * y + 0.2 * z;
      scene.surfaces.push_back({{x, y, z}, {0.1 * z, 0.35, 0.05 * y}, {0.15, -0.05, 0.35}, white});
    }
  }
  return scene;
}

double grey_at(const Image& image, const Eigen::Vector2d& at) {
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  const double fx = at.x() - x, fy = at.y() - y;
  const auto pixel = [&](int u, int v) { return static_cast<double>(image.pixels[static_cast<std::size_t>(3 * (v * image.width + u))]); };
  return (1 - fy) * ((1 - fx) * pixel(x, y) + fx * pixel(x + 1, y)) + fy * ((1 - fx) * pixel(x, y + 1) + fx * pixel(x + 1, y + 1));
}

/// How far the step between dark and bright lies beyond `at` in the direction `out` (from bright to dark), pixels.
double step_at(const Image& image, const Eigen::Vector2d& at, const Eigen::Vector2d& out) {
  constexpr double reach = 5, each = 0.1;
  const double bright = grey_at(image, at - reach * out), dark = grey_at(image, at + reach * out);
  double width = 0;
  for (double s = -reach + each / 2; s < reach; s += each) width += each * (grey_at(image, at + s * out) - dark) / (bright - dark);
  return width - reach;
}

TEST(WrittenCamera, EdgesAreWhereTheConfigurationSays) {
  lab::SimulatorConfig config;
  config.camera.read_noise = config.camera.photon_noise = 0;
  const lab::Settings settings =
      lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
  const CameraMount& written = settings.robot.camera;
  ASSERT_EQ(written.model, "pinhole_radtan");
  const lab::World world(squares(), 1);
  const lab::CameraSensor camera(config, world);
  int count = 0;
  for (const double turned : {-0.3, 0.0, 0.35}) {
    const SE3 T_WI{SO3::Exp({0.1 * turned, 0, turned}) * config.shape.T_torso_imu().R, {0, 0.1, 0.5}};
    const SE3 T_WT = T_WI * config.shape.T_torso_imu().inverse();
    const Image image = camera.image(
        0, 0, [&](double) { return T_WT; }, Workers());
    ASSERT_EQ(image.width, written.width);
    for (const lab::Surface& s : world.surfaces()) {
      const Eigen::Vector2d middle = pixel_of(written, T_WI, s.corner + s.u / 2 + s.v / 2);
      for (const double a : {0.3, 0.5, 0.7}) {
        const std::array<Eigen::Vector3d, 4> starts{s.corner, s.corner + s.v, s.corner, s.corner + s.u};
        const std::array<Eigen::Vector3d, 4> sides{s.u, s.u, s.v, s.v};
        for (std::size_t k = 0; k < 4; ++k) {
          const Eigen::Vector2d at = pixel_of(written, T_WI, starts[k] + a * sides[k]);
          if (at.minCoeff() < 8 || at.x() > written.width - 9 || at.y() > written.height - 9) continue;
          const Eigen::Vector2d along = pixel_of(written, T_WI, starts[k] + (a + 0.01) * sides[k]) - at;
          Eigen::Vector2d out = Eigen::Vector2d(-along.y(), along.x()).normalized();
          if (out.dot(at - middle) < 0) out = -out;
          EXPECT_LT(std::abs(step_at(image, at, out)), 0.2) << at.transpose();
          ++count;
        }
      }
    }
  }
  EXPECT_GT(count, 200);
}

}  // namespace camera_test
}  // namespace kilvo
