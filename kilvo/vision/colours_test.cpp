#include "kilvo/vision/colours.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace colours_test {

using Rgb = std::array<std::uint8_t, 3>;
using Points = std::vector<Eigen::Vector4f>;

Camera small_camera() {
  CameraMount mount;
  mount.width = 64;
  mount.height = 48;
  mount.fx = mount.fy = 40;
  mount.cx = 31.5;
  mount.cy = 23.5;
  return Camera(mount);
}

/// Red grows to the right, green downwards, blue is the same everywhere.
Image drawn(int channels) {
  Image out{64, 48, channels, {}};
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) {
      for (const int value : {2 * u, 3 * v, 77}) {
        if (channels == 3 || value == 2 * u) out.pixels.push_back(static_cast<std::uint8_t>(value));
        if (channels == 1) break;
      }
    }
  }
  return out;
}

/// A point that the camera at the origin sees in the middle of a pixel.
Eigen::Vector4f seen_at(int u, int v, float depth) {
  return {depth * (static_cast<float>(u) - 31.5F) / 40, depth * (static_cast<float>(v) - 23.5F) / 40, depth, 9};
}

std::vector<ColouredPoint> colours(const Points& points, const Image& image, double tau = 1, const SE3& T_CW = {}) {
  const Camera camera = small_camera();
  return colours_of(image, tau, camera, T_CW, DepthView(camera, T_CW, points));
}

TEST(Colours, AreThoseOfThePixelsThatSeeThePoints) {
  const Points points{seen_at(10, 5, 2), seen_at(40, 30, 3), seen_at(60, 44, 2.5F)};
  const auto found = colours(points, drawn(3));
  ASSERT_EQ(found.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(found[i].p_W, points[i].head<3>());
  EXPECT_EQ(found[0].rgb, (Rgb{20, 15, 77}));
  EXPECT_EQ(found[1].rgb, (Rgb{80, 90, 77}));
  EXPECT_EQ(found[2].rgb, (Rgb{120, 132, 77}));
}

TEST(Colours, AreThoseBesideTheGreys) {
  Image image{64, 48, 1, std::vector<std::uint8_t>(64 * 48, 100)};
  image.chroma_width = 32;
  image.chroma_height = 24;
  image.chroma.assign(2 * 32 * 24, 128);
  image.chroma[32 * 24 + 2 * 32 + 5] = 178;
  const auto found = colours({seen_at(10, 5, 2), seen_at(40, 30, 3)}, image);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].rgb, (Rgb{170, 64, 100}));
  EXPECT_EQ(found[1].rgb, (Rgb{100, 100, 100}));
}

TEST(Colours, AGreyImageGivesGreys) {
  const auto found = colours({seen_at(10, 5, 2)}, drawn(1));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].rgb, (Rgb{20, 20, 20}));
}

// An image exposed twice as long is twice as bright, and its tau a half.
TEST(Colours, AreAsTheFirstImageWouldHaveShownThem) {
  EXPECT_EQ(colours({seen_at(40, 30, 2)}, drawn(3), 0.5)[0].rgb, (Rgb{40, 45, 39}));  // 38.5 is rounded
  EXPECT_EQ(colours({seen_at(40, 30, 2)}, drawn(3), 3)[0].rgb, (Rgb{240, 255, 231}));
}

TEST(Colours, WhatIsHiddenOrOutsideHasNone) {
  EXPECT_EQ(colours({seen_at(30, 20, 2), seen_at(30, 20, 5)}, drawn(3)).size(), 1u);
  EXPECT_TRUE(colours({seen_at(-3, 20, 2), seen_at(30, 60, 2), seen_at(30, 20, -2)}, drawn(3)).empty());
  EXPECT_TRUE(colours({}, drawn(3)).empty());
}

// The view may have been made where the camera was thought to be.
TEST(Colours, AreTakenWhereThePoseSeesThePoints) {
  const Camera camera = small_camera();
  const Points points{seen_at(30, 20, 2)};
  const DepthView view(camera, SE3{}, points);
  const SE3 aside{SO3(), {0.1, 0, 0}};  // two pixels to the right at 2 m
  EXPECT_EQ(colours_of(drawn(3), 1, camera, aside, view)[0].rgb, (Rgb{64, 60, 77}));
}

TEST(Colours, NearPointsWeighMoreAndOverexposedOnesLittle) {
  Image image = drawn(3);
  const auto found = colours({seen_at(10, 20, 1), seen_at(30, 20, 2)}, image);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_FLOAT_EQ(found[0].weight, 4 * found[1].weight);
  image.pixels[3 * (20 * 64 + 10) + 2] = 255;
  EXPECT_LT(colours({seen_at(10, 20, 1)}, image)[0].weight, 0.1F * found[1].weight);
}

}  // namespace colours_test
}  // namespace kilvo
