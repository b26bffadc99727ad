#include "kilvo/vision/visual_pipeline.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "tests/helpers/tiny_scene.hpp"

namespace kilvo {
namespace visual_pipeline_test {

// A camera that is carried before a wall.
class BeforeTheWall {
 public:
  // `turned`: by how much the description is, about the IMU's axes, rad.
  explicit BeforeTheWall(const Eigen::Vector3d& turned = Eigen::Vector3d::Zero())
      : camera_(tiny::Scene::mount()),
        surfaces_(MapConfig{}),
        pipeline_(mount_turned_by(turned), VisionConfig{}, VisualMapConfig{}, UpdateConfig{}, 100) {
    surfaces_.insert(scene_.groups(), 0);
    pipeline_.see(scene_.points());
  }

  // From a pose that is known. Returns how many patches were found.
  int see_from(const SE3& T_WI) {
    const VisualRegistration seen = look_from(T_WI, 1e-10);
    EXPECT_FALSE(seen.refused) << images_;
    return seen.used;
  }

  // `variance`: of the prior. `covered`: columns of the image that show nothing of the wall.
  VisualRegistration look_from(const SE3& T_WI, double variance, int covered = 0, const Eigen::Vector3d& off = Eigen::Vector3d::Zero()) {
    GreyImage grey = scene_.image(camera_, T_WI);
    ++images_;
    for (int v = 0; v < grey.height; ++v)
      for (int u = 0; u < covered; ++u)
        grey.pixels[static_cast<std::size_t>(v * grey.width + u)] = static_cast<std::uint8_t>(random_() % 256);
    const CameraImage image = {Time{images_ * std::chrono::milliseconds(100)}, {grey.width, grey.height, 1, grey.pixels}};
    ImageContext context;
    context.prior.t = image.t;
    context.prior.x.R = T_WI.R;
    context.prior.x.p = T_WI.p + off;
    context.prior.P.diagonal().setConstant(variance);
    VisualRegistration seen = pipeline_.measure(image, context);
    if (!seen.refused) pipeline_.learn(surfaces_, PoseCovariance::Zero());
    return seen;
  }

  // Calls f(observation, its frame) for all views of all points, and returns how many points have all that they may.
  template <class F>
  int visit_views(F&& f) const {
    const VisualMap& map = pipeline_.map();
    int full = 0;
    for (double y = -1.9; y < 2; y += 0.5) {
      for (double z = -1.9; z < 2; z += 0.5) {
        for (const double x : {2.8, 3.2}) {
          map.visit(map.key_of({x, y, z}), [&](std::uint32_t, const VisualPoint& p) {
            full += p.count == VisualPoint::most_observations ? 1 : 0;
            for (std::size_t k = 0; k < p.count; ++k)
              f(map.observation(p.observations[k]), map.frame(map.observation(p.observations[k]).frame));
          });
        }
      }
    }
    return full;
  }

 private:
  static CameraMount mount_turned_by(const Eigen::Vector3d& turned) {
    CameraMount mount = tiny::Scene::mount();
    mount.T_imu_camera.R = SO3::Exp(turned) * mount.T_imu_camera.R;
    return mount;
  }

  std::mt19937 random_{3};
  tiny::Scene scene_;
  Camera camera_;
  VoxelMap surfaces_;
  VisualPipeline pipeline_;
  int images_ = 0;
};

// A point that has as many views as it may gives one up for a new one: the one that this image was held against, as often as not. What the
// image says of that one must not be told of the new one, which no image has been held against.
TEST(VisualPipeline, AViewIsNotJudgedByTheImageThatItWasTakenFrom) {
  BeforeTheWall wall;
  const SE3 T_CI = tiny::Scene::mount().T_imu_camera.inverse();
  int taken = 0, judged = 0, full = 0;
  for (const double x : {0.0, 0.8, 1.4, 0.3, 1.1}) {
    for (const double y : {-0.8, 0.0, 0.8}) {
      for (const double z : {-0.6, 0.0, 0.6}) {
        const SE3 T_WI = {SO3(), {x, y, z}};
        if (wall.see_from(T_WI) == 0) continue;
        const SE3 T_CW = T_CI * T_WI.inverse();
        const auto look = [&](const Observation& o, const VisualFrame& frame) {
          if ((frame.T_CW.p - T_CW.p).norm() > 1e-9) return;
          ++taken;
          judged += o.agreement != 1 ? 1 : 0;
        };
        full += wall.visit_views(look);
      }
    }
  }
  EXPECT_EQ(judged, 0) << "of " << taken;
  EXPECT_GT(taken, 500);
  EXPECT_GT(full, 100) << "points had all the views that they may";
}

// A mount that is off by a degree, as a careful one may be, is measured against the poses that sweeps hold, and corrected.
TEST(VisualPipeline, ACameraThatIsTurnedByADegreeIsCorrected) {
  BeforeTheWall wall({0.008, -0.01, 0.009});
  std::optional<SO3> corrected;
  int used = 0, images = 0;
  for (int i = 0; i < 150; ++i) {
    const SE3 T_WI = {SO3::Exp({0.2 * std::sin(0.5 * i), 0.1 * std::sin(0.7 * i), 0.15 * std::sin(0.31 * i)}),
                      {0, 0.05 * std::sin(0.4 * i), 0}};
    const VisualRegistration seen = wall.look_from(T_WI, 1e-8);
    if (seen.refused == Reason::mount_doubted) corrected = seen.turned.corrected;
    if (i < 100) continue;
    ++images;
    used += seen.carries ? 1 : 0;
  }
  ASSERT_TRUE(corrected);
  EXPECT_LT((*corrected * tiny::Scene::mount().T_imu_camera.R.inverse()).Log().norm(), 0.004) << "of 0.0157 rad";
  EXPECT_GT(used, 0.9 * images);
}

// Where an image shows hardly anything of what it should, the few patches that fit somewhere say nothing of the pose.
TEST(VisualPipeline, AFewPatchesAmongManyDoNotMoveThePose) {
  BeforeTheWall wall;
  wall.see_from({});
  int accepted = 0;
  for (int i = 0; i < 25; ++i) {
    const Eigen::Vector3d off(0, 0.004, 0);
    const VisualRegistration seen = wall.look_from({}, 1e-4, 280, off);
    EXPECT_FALSE(seen.carries);
    EXPECT_EQ(seen.posterior.x.p, off) << i;
    if (seen.refused) continue;
    ++accepted;
    EXPECT_GT(seen.used, 0) << "that one would have moved it";
  }
  EXPECT_GT(accepted, 0) << "the world may have changed: it is learnt again";
}

}  // namespace visual_pipeline_test
}  // namespace kilvo
