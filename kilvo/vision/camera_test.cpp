#include "kilvo/vision/camera.hpp"

#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <stdexcept>
#include <string>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace camera_test {

using ::testing::HasSubstr;
using Vector = Eigen::Vector3d;

CameraMount pinhole(std::vector<double> distortion) {
  CameraMount m;
  m.model = "pinhole_radtan";
  m.width = 752;
  m.height = 480;
  m.fx = 458;
  m.fy = 457;
  m.cx = 367;
  m.cy = 248;
  m.distortion = std::move(distortion);
  return m;
}

CameraMount fisheye(std::vector<double> distortion) {
  CameraMount m;
  m.model = "equidistant";
  m.width = 512;
  m.height = 512;
  m.fx = 190;
  m.fy = 191;
  m.cx = 254;
  m.cy = 256;
  m.distortion = std::move(distortion);
  return m;
}

/// Lenses as they are sold: barrels, a pincushion, a lens that sits askew, fisheyes.
std::vector<CameraMount> lenses() {
  return {pinhole({}),
          pinhole({-0.28, 0.07, 2e-4, 2e-5}),
          pinhole({-0.35, 0.15, 1e-3, -5e-4, -0.02}),
          pinhole({0.12, -0.05, -2e-3, 3e-3, 0.02}),
          pinhole({0.3, 0.1, 0, 0}),
          pinhole({0, 0, 5e-3, -8e-3}),
          fisheye({}),
          fisheye({0.003, 0.0007, -0.002, 0.0002}),
          fisheye({-0.02, 0.004, -0.002, 0.0003}),
          fisheye({0.05, -0.03, 0.01, -0.001})};
}

template <class Function>
void for_pixels_of(const Camera& camera, Function&& function) {
  for (int v = 0; v < camera.height(); v += 17) {
    for (int u = 0; u < camera.width(); u += 17) function(Eigen::Vector2d(u, v));
  }
}

/// Whether a direction comes near the edge of what a fisheye may see, 90 degrees.
bool on_the_edge(const Vector& direction) { return direction.z() / direction.norm() < 0.02; }

TEST(Camera, SeesAKnownPointWhereThePublishedFormulaSays) {
  const Camera radtan(pinhole({-0.28, 0.07, 2e-3, -3e-3, 0.01}));
  EXPECT_NEAR((*radtan.project({0.6, -0.4, 2}) - Eigen::Vector2d(499.028342878, 160.173285742)).norm(), 0, 1e-6);
  const Camera equidistant(fisheye({0.003, 0.0007, -0.002, 0.0002}));
  EXPECT_NEAR((*equidistant.project({1.2, -0.9, 0.5}) - Eigen::Vector2d(443.850103531, 112.863014048)).norm(), 0, 1e-6);
}

TEST(Camera, APixelsDirectionIsSeenInThatPixelAtAnyDistance) {
  test::Random random(1);
  for (const CameraMount& lens : lenses()) {
    const Camera camera(lens);
    int pixels = 0, seen = 0;
    for_pixels_of(camera, [&](const Eigen::Vector2d& pixel) {
      ++pixels;
      const auto direction = camera.unproject(pixel);
      if (!direction) return;
      ++seen;
      EXPECT_EQ(direction->z(), 1);
      const auto again = camera.project(random.uniform(0.1, 60) * *direction);
      ASSERT_TRUE(again) << pixel.transpose();
      EXPECT_LT((*again - pixel).norm(), 1e-9) << pixel.transpose();
    });
    EXPECT_GT(seen, lens.model == "equidistant" ? 0.75 * pixels : pixels - 1);  // the corners of a fisheye's image are black
  }
}

TEST(Camera, APointsPixelLooksAtThePoint) {
  test::Random random(2);
  for (const CameraMount& lens : lenses()) {
    const Camera camera(lens);
    int seen = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vector p_C = random.uniform(0.1, 60) * Vector(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), 1);
      const auto pixel = camera.project(p_C);
      if (!pixel || !camera.sees(*pixel, 0)) continue;
      ++seen;
      const auto direction = camera.unproject(*pixel);
      ASSERT_TRUE(direction);
      EXPECT_LT((*direction - p_C / p_C.z()).norm(), 1e-9);
    }
    EXPECT_GT(seen, 200);
  }
}

TEST(Camera, TheJacobianIsTheDifferenceOverTheWholeImage) {
  test::Random random(3);
  for (const CameraMount& lens : lenses()) {
    const Camera camera(lens);
    for_pixels_of(camera, [&](const Eigen::Vector2d& pixel) {
      const auto direction = camera.unproject(pixel);
      if (!direction || on_the_edge(*direction)) return;
      const Vector p_C = random.uniform(0.5, 20) / direction->norm() * *direction;
      const auto seen = camera.project_with_jacobian(p_C);
      ASSERT_TRUE(seen);
      const double step = 1e-5 * p_C.z();
      for (int axis = 0; axis < 3; ++axis) {
        const Vector d = step * Vector::Unit(axis);
        const Eigen::Vector2d difference = (*camera.project(p_C + d) - *camera.project(p_C - d)) / (2 * step);
        EXPECT_LT((difference - seen->J.col(axis)).norm() * p_C.z(), 1e-5 * lens.fx) << pixel.transpose() << ", axis " << axis;
      }
    });
  }
}

TEST(Camera, IsSmoothOnItsAxis) {
  for (const CameraMount& lens : lenses()) {
    const Camera camera(lens);
    const auto on = camera.project_with_jacobian({0, 0, 2}), beside = camera.project_with_jacobian({3e-8, -1e-8, 2});
    EXPECT_LT((on->pixel - Eigen::Vector2d(lens.cx, lens.cy)).norm(), 1e-12);
    EXPECT_LT((on->J - beside->J).norm(), 1e-5);
    EXPECT_NEAR(on->J(0, 0), lens.fx / 2, 1e-9);
    EXPECT_NEAR(on->J(1, 1), lens.fy / 2, 1e-9);
    EXPECT_LT((*camera.unproject({lens.cx, lens.cy}) - Vector::UnitZ()).norm(), 1e-12);
  }
}

TEST(Camera, SeesNothingBehindItselfNorWhatIsNoNumber) {
  const double nan = std::nan("");
  for (const CameraMount& lens : lenses()) {
    const Camera camera(lens);
    for (const Vector& p_C :
         {Vector(0, 0, -1), Vector(0.1, 0.2, -1), Vector(0, 0, 0), Vector(1, 0, 0), Vector(nan, 0, 1), Vector(0, 0, nan)}) {
      EXPECT_FALSE(camera.project(p_C)) << p_C.transpose();
      EXPECT_FALSE(camera.project_with_jacobian(p_C)) << p_C.transpose();
    }
    EXPECT_FALSE(camera.unproject({nan, 3}));
    EXPECT_FALSE(camera.unproject({1e300, -1e300}));
  }
}

// r (1 - 0.3 r^2) grows up to r = 1.054 and falls then: what lies at 1.5 would be seen in the middle of the image.
TEST(Camera, SeesNothingWhereThePolynomialHasTurnedBack) {
  const Camera camera(pinhole({-0.3, 0, 0, 0}));
  const double turn = std::sqrt(1 / 0.9);
  EXPECT_TRUE(camera.project({turn - 1e-6, 0, 1}));
  EXPECT_FALSE(camera.project({turn + 1e-6, 0, 1}));
  EXPECT_FALSE(camera.project({0, 1.5, 1}));
  const double farthest = turn * (1 - 0.3 * turn * turn);
  EXPECT_NEAR(camera.unproject({367 + 458 * (farthest - 1e-9), 248})->x(), turn, 1e-3);
  EXPECT_FALSE(camera.unproject({367 + 458 * (farthest + 1e-9), 248}));
  EXPECT_FALSE(camera.unproject({367 + 458 * 2, 248}));
}

TEST(Camera, FindsTheFirstOfSeveralTurns) {
  // 1 + 3 k1 r^2 + 5 k2 r^4 + 7 k3 r^6 = (1 - r^2) (1 - r^2 / 4) (1 - r^2 / 9)
  const Camera camera(pinhole({-(1 + 0.25 + 1 / 9.0) / 3, (0.25 + 1 / 9.0 + 1 / 36.0) / 5, 0, 0, -1 / 36.0 / 7}));
  EXPECT_TRUE(camera.project({0, 1 - 1e-9, 1}));
  EXPECT_FALSE(camera.project({0, 1 + 1e-9, 1}));
  EXPECT_FALSE(camera.project({2.5, 0, 1}));  // growing again
  const Camera round(fisheye({-0.25, 0, 0, 0}));
  const double turn = std::sqrt(1 / 0.75);
  EXPECT_TRUE(round.project({std::tan(turn - 1e-6), 0, 1}));
  EXPECT_FALSE(round.project({std::tan(turn + 1e-6), 0, 1}));
}

// Far out, where r^2 outgrows r, the tangential part alone would bring points back into the image.
TEST(Camera, TheTangentialPartBringsNothingBackIntoTheImage) {
  const Camera camera(pinhole({0, 0, 0, 0.01}));
  test::Random random(4);
  for (int i = 0; i < 20000; ++i) {
    const double angle = random.uniform(0, 2 * std::numbers::pi), r = std::exp(random.uniform(0, 6));
    const auto pixel = camera.project({r * std::cos(angle), r * std::sin(angle), 1});
    EXPECT_FALSE(r > 1.5 && pixel && camera.sees(*pixel, 0)) << r << " " << angle;
  }
}

TEST(Camera, AFisheyeSeesAlmostSideways) {
  const Camera camera(fisheye({}));
  const double angle = 89.9 * std::numbers::pi / 180;
  const Vector p_C(0, 3 * std::sin(angle), 3 * std::cos(angle));
  EXPECT_NEAR(camera.project(p_C)->y(), 256 + 191 * angle, 1e-9);
  EXPECT_LT((*camera.unproject(*camera.project(p_C)) - p_C / p_C.z()).norm(), 1e-9 * 573);
  EXPECT_FALSE(camera.unproject({254, 256 + 191 * 1.571}));
}

TEST(Camera, SeesUpToItsBorder) {
  const Camera camera(pinhole({}));
  EXPECT_TRUE(camera.sees({0, 0}, 0));
  EXPECT_TRUE(camera.sees({751, 479}, 0));
  EXPECT_FALSE(camera.sees({751.1, 479}, 0));
  EXPECT_FALSE(camera.sees({5, 4.9}, 5));
  EXPECT_FALSE(camera.sees({std::nan(""), 9}, 0));
}

std::string refusal(const std::function<void(CameraMount&)>& spoil, bool round = false) {
  CameraMount mount = round ? fisheye({}) : pinhole({});
  spoil(mount);
  try {
    const Camera camera(mount);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(Camera, RefusesNumbersThatMakeNoSenseByTheirKey) {
  const double nan = std::nan("");
  EXPECT_THAT(refusal([](auto& m) { m.model = "pinhole"; }), HasSubstr("camera.model"));
  EXPECT_THAT(refusal([](auto& m) { m.width = 15; }), HasSubstr("camera.width"));
  EXPECT_THAT(refusal([](auto& m) { m.height = -480; }), HasSubstr("camera.height"));
  EXPECT_THAT(refusal([](auto& m) { m.fx = 0; }), HasSubstr("camera.fx"));
  EXPECT_THAT(refusal([&](auto& m) { m.fy = nan; }), HasSubstr("camera.fy"));
  EXPECT_THAT(refusal([](auto& m) { m.fy = INFINITY; }), HasSubstr("camera.fy"));
  EXPECT_THAT(refusal([&](auto& m) { m.cx = nan; }), HasSubstr("camera.cx"));
  EXPECT_THAT(refusal([](auto& m) { m.cy = INFINITY; }), HasSubstr("camera.cy"));
  for (const std::size_t count : {1u, 3u, 6u, 8u})
    EXPECT_THAT(refusal([&](auto& m) { m.distortion.assign(count, 0.0); }), HasSubstr("camera.distortion"));
  EXPECT_THAT(refusal([](auto& m) { m.distortion.assign(5, 0.0); }, true), HasSubstr("camera.distortion"));
  EXPECT_THAT(refusal([&](auto& m) { m.distortion = {0, 0, nan, 0}; }), HasSubstr("camera.distortion"));
  EXPECT_EQ(refusal([](auto& m) { m.width = m.height = 16; }), "no error");
  EXPECT_EQ(refusal([](auto& m) { m.distortion.assign(5, 0.0); }), "no error");
}

}  // namespace camera_test
}  // namespace kilvo
