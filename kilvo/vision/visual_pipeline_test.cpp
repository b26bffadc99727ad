#include "kilvo/vision/visual_pipeline.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/tiny_scene.hpp"

namespace kilvo {
namespace visual_pipeline_test {

// A camera that is carried before a wall.
class BeforeTheWall {
 public:
  BeforeTheWall()
      : camera_(tiny::Scene::mount()),
        surfaces_(MapConfig{}),
        pipeline_(tiny::Scene::mount(), VisionConfig{}, VisualMapConfig{}, UpdateConfig{}, 100) {
    surfaces_.insert(scene_.groups(), 0);
    pipeline_.see(scene_.points());
  }

  // From a pose that is known. Returns how many patches were found.
  int see_from(const SE3& T_WI) {
    const GreyImage grey = scene_.image(camera_, T_WI);
    ++images_;
    const CameraImage image = {Time{images_ * std::chrono::milliseconds(100)}, {grey.width, grey.height, 1, grey.pixels}};
    ImageContext context;
    context.prior.t = image.t;
    context.prior.x.R = T_WI.R;
    context.prior.x.p = T_WI.p;
    context.prior.P.diagonal().setConstant(1e-10);
    const VisualRegistration seen = pipeline_.measure(image, context);
    EXPECT_FALSE(seen.refused) << images_;
    if (!seen.refused) pipeline_.learn(surfaces_, PoseCovariance::Zero());
    return seen.used;
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

}  // namespace visual_pipeline_test
}  // namespace kilvo
