#include "lab/simulation/camera_sensor.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "tests/helpers/patch_view.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo::lab {
namespace camera_sensor_test {

using test::all_of;
using test::only;
using test::scenario;
using test::small;

TEST(Camera, ProjectionAndItsInverseAgree) {
  const CameraModel model;
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(639, 10), Eigen::Vector2d(320, 240), Eigen::Vector2d(100, 479)}) {
    EXPECT_LT((project(model, unproject(model, pixel)) - pixel).norm(), 1e-6);
  }
}

// Every patch of contrast, not most of them. One surface fills it and its surroundings: where something nearer hides part of it, the two
// images do not show the same points. The worlds' every texture, near and far, frontal and grazed, is among the patches.
TEST(Camera, TheSamePointLooksTheSameHalfASecondLater) {
  for (const char* name : {"room", "corridor", "stairs", "yard", "blank_wall"}) {
    SimulatorConfig config = only({Sensor::camera}, 0);
    config.camera.read_noise = config.camera.photon_noise = 0;
    const Simulator simulator(scenario(name), config);
    const CameraSensor camera(simulator.config(), simulator.world());
    const auto torso_at = [&](double t) { return simulator.walk().torso(t); };
    double worst = 1;
    int count = 0;
    for (const double t : {4.5, 9.0, 16.0}) {
      const Image first = camera.image(0, t, torso_at, Workers(2)), second = camera.image(1, t + 0.5, torso_at, Workers(2));
      const test::PatchView view{simulator, first, second, torso_at(t) * config.camera.T_torso_camera,
                                 torso_at(t + 0.5) * config.camera.T_torso_camera};
      for (int v = 20; v < 460; v += 14) {
        for (int u = 20; u < 620; u += 14) {
          const auto c = view.correlation(u, v);
          if (!c) continue;
          worst = std::min(worst, *c);
          ++count;
        }
      }
    }
    testing::Test::RecordProperty(std::string(name) + "_worst", std::to_string(worst));
    EXPECT_GT(count, 150) << name;
    EXPECT_GT(worst, 0.99) << name << ", of " << count << " patches";
  }
}

TEST(Camera, ItsExposureChanges) {
  SimulatorConfig config = small(2);
  config.use = {false, false, false, true};
  config.camera.delivery.rate = 1;
  config.camera.read_noise = config.camera.photon_noise = 0;
  Simulator simulator(scenario("stand"), config);
  const auto images = all_of(simulator);
  const auto& model = config.camera;
  const Image &a = std::get<CameraImage>(images[0]).image, &b = std::get<CameraImage>(images[1]).image;
  const double gain = exposure_at(model, 1) / exposure_at(model, 0);
  EXPECT_GT(gain, 1.1);
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (a.pixels[i] < 20 || b.pixels[i] > 250) continue;
    EXPECT_NEAR(b.pixels[i], gain * a.pixels[i], 1.3);
  }
}

TEST(Camera, MotionBlurSmearsWhatAMovingCameraSees) {
  const auto sharpness = [](int blur_samples) {
    SimulatorConfig config = small(0);
    config.camera.blur_samples = blur_samples;
    config.camera.exposure = 0.03;
    config.camera.gain = 40;
    config.camera.read_noise = config.camera.photon_noise = 0;
    const World world(make_scene("room", 1), 1);
    const CameraSensor camera(config, world);
    // Turns at 2 rad/s.
    const Image image = camera.image(
        0, 1,
        [](double t) {
          return SE3{SO3::Exp({0, 0, 2 * t}), {0, 0, 0.8}};
        },
        Workers());
    double sum = 0;
    for (std::size_t i = 3; i < image.pixels.size(); ++i) sum += std::abs(image.pixels[i] - image.pixels[i - 3]);
    return sum / static_cast<double>(image.pixels.size());
  };
  EXPECT_LT(sharpness(8), 0.8 * sharpness(1));
}

}  // namespace camera_sensor_test
}  // namespace kilvo::lab
