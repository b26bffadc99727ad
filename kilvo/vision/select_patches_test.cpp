#include "kilvo/vision/select_patches.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/tiny_scene.hpp"

namespace kilvo {
namespace select_patches_test {

// A wall along which a robot walks: far away on one side of a patch, near on the other.
struct Wall {
  Eigen::Vector3d p{3.0, 1.2, 0.1}, n = Eigen::Vector3d(0.05, -1, 0.02).normalized();

  Eigen::Vector2d seen_from(const Camera& camera, const SE3& T_CW, const SE3& T_RW, const Eigen::Vector2d& pixel) const {
    const SE3 T_WC = T_CW.inverse();
    const Eigen::Vector3d ray = T_WC.R * *camera.unproject(pixel);
    return *camera.project(T_RW * (T_WC.p + ray * (n.dot(p - T_WC.p) / n.dot(ray))));
  }
};

double largest_error(const CameraMount& mount, bool with_perspective) {
  const Camera camera(mount);
  const SE3 T_CI = mount.T_imu_camera.inverse();
  const SE3 T_CW = T_CI * SE3{SO3::Exp({0, 0.02, 0.1}), {0.6, 0, 0}}.inverse(),
            T_RW = T_CI * SE3{SO3::Exp({0.01, 0, 0.1}), {0, 0, 0}}.inverse();
  const Wall wall;
  PlaneWarp warp = *warp_between(camera, T_CW, T_RW, wall.p, wall.n);
  if (!with_perspective) warp.c.setZero();
  const Eigen::Vector2d here = *camera.project(T_CW * wall.p), there = *camera.project(T_RW * wall.p);
  double worst = 0;
  for (const Eigen::Vector2d& d : {Eigen::Vector2d(4, 0), Eigen::Vector2d(-4, 0), Eigen::Vector2d(0, 4), Eigen::Vector2d(-4, -4)}) {
    const Eigen::Vector2d predicted = there + warp.A * d / (1 + warp.c.dot(d));
    worst = std::max(worst, (predicted - wall.seen_from(camera, T_CW, T_RW, here + d)).norm());
  }
  return worst;
}

TEST(WarpBetween, IsExactForAPlaneAndAPinhole) {
  CameraMount mount = tiny::Scene::mount();
  mount.distortion = {0, 0, 0, 0};
  EXPECT_LT(largest_error(mount, true), 1e-9);
  EXPECT_GT(largest_error(mount, false), 0.02) << "the wall is steep enough to tell";
}

TEST(WarpBetween, ALensThatBendsLittleChangesItLittle) { EXPECT_LT(largest_error(tiny::Scene::mount(), true), 0.005); }

}  // namespace select_patches_test
}  // namespace kilvo
