#include "kilvo/vision/pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace pyramid_test {

template <class Function>
GreyImage drawn(int width, int height, Function&& value) {
  GreyImage out{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.pixels.push_back(static_cast<std::uint8_t>(value(x, y)));
  }
  return out;
}

GreyImage noise(int width, int height, std::uint64_t seed) {
  test::Random random(seed);
  return drawn(width, height, [&](int, int) { return random.uniform(0, 255.999); });
}

/// The definition, pixel by pixel.
int blended(const GreyImage& image, int u, int v) {
  const int weights[] = {1, 3, 3, 1};
  int sum = 32;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      const int x = std::clamp(2 * u - 1 + i, 0, image.width - 1), y = std::clamp(2 * v - 1 + j, 0, image.height - 1);
      sum += weights[i] * weights[j] * image.at(x, y);
    }
  }
  return sum / 64;
}

TEST(Pyramid, HalfIsTheBinomialMeanRounded) {
  for (const auto& [width, height] : {std::pair{64, 48}, {65, 49}, {33, 2}, {2, 33}, {3, 3}, {2, 2}, {641, 17}}) {
    const GreyImage image = noise(width, height, 1), half = half_of(image);
    ASSERT_EQ(half.width, width / 2);
    ASSERT_EQ(half.height, height / 2);
    ASSERT_EQ(half.pixels.size(), static_cast<std::size_t>(half.width * half.height));
    for (int v = 0; v < half.height; ++v) {
      for (int u = 0; u < half.width; ++u)
        ASSERT_EQ(half.at(u, v), blended(image, u, v)) << width << "x" << height << ": " << u << " " << v;
    }
  }
}

TEST(Pyramid, AConstantStaysTheSame) {
  for (const int value : {0, 1, 127, 254, 255}) {
    for (const GreyImage& level : pyramid_of(drawn(131, 97, [&](int, int) { return value; }), 3)) {
      for (const std::uint8_t pixel : level.pixels) ASSERT_EQ(pixel, value);
    }
  }
}

// Rising by 2 to the right and 4 down: in the middle between four pixels it is 2 * 0.5 + 4 * 0.5 more, a whole number.
TEST(Pyramid, ARampIsExactWhereTheHalfPixelsLie) {
  const auto ramp = [](double x, double y) { return 2 * x + 4 * y; };
  const GreyImage half = half_of(drawn(40, 40, ramp));
  for (int v = 1; v < half.height - 1; ++v) {
    for (int u = 1; u < half.width - 1; ++u) ASSERT_EQ(half.at(u, v), ramp(2 * u + 0.5, 2 * v + 0.5));
  }
}

TEST(Pyramid, EachLevelShowsARampWhereAtLevelSays) {
  const auto ramp = [](const Eigen::Vector2d& pixel) { return 20 + 0.437 * pixel.x() + 0.291 * pixel.y(); };
  const auto levels = pyramid_of(drawn(320, 256, [&](int x, int y) { return std::lround(ramp(Eigen::Vector2d(x, y))); }), 4);
  ASSERT_EQ(levels.size(), 4u);
  test::Random random(2);
  for (int level = 0; level < 4; ++level) {
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector2d pixel(random.uniform(40, 280), random.uniform(40, 216)), there = at_level(pixel, level);
      const auto seen = sample(levels[static_cast<std::size_t>(level)].pixels.data(), levels[static_cast<std::size_t>(level)].width,
                               static_cast<float>(there.x()), static_cast<float>(there.y()));
      EXPECT_NEAR(seen, ramp(pixel), 0.75) << "level " << level;  // each level rounds; half a pixel of level 3 would be 2
    }
  }
}

TEST(Pyramid, AlternatingPixelsBecomeGrey) {
  const GreyImage board = half_of(drawn(64, 64, [](int x, int y) { return 255 * ((x + y) % 2); }));
  const GreyImage stripes = half_of(drawn(64, 64, [](int x, int) { return 255 * (x % 2); }));
  for (const GreyImage& half : {board, stripes}) {
    for (int v = 1; v < half.height - 1; ++v) {
      for (int u = 1; u < half.width - 1; ++u) ASSERT_EQ(half.at(u, v), 128);
    }
  }
}

TEST(Pyramid, LevelsHalveUntilTheyWouldBeSmallerThanSixteenPixels) {
  const auto sizes = [](int width, int height, int levels) {
    std::vector<std::pair<int, int>> out;
    for (const GreyImage& level : pyramid_of(noise(width, height, 3), levels)) out.emplace_back(level.width, level.height);
    return out;
  };
  using Sizes = std::vector<std::pair<int, int>>;
  EXPECT_EQ(sizes(640, 512, 4), (Sizes{{640, 512}, {320, 256}, {160, 128}, {80, 64}}));
  EXPECT_EQ(sizes(131, 67, 9), (Sizes{{131, 67}, {65, 33}, {32, 16}}));
  EXPECT_EQ(sizes(131, 67, 2), (Sizes{{131, 67}, {65, 33}}));
  EXPECT_EQ(sizes(1000, 31, 4), (Sizes{{1000, 31}}));
  EXPECT_EQ(sizes(1, 1, 4), (Sizes{{1, 1}}));
  EXPECT_EQ(sizes(0, 0, 4), (Sizes{{0, 0}}));
}

TEST(Pyramid, LevelZeroIsTheImageItself) {
  const GreyImage image = noise(77, 55, 4);
  EXPECT_EQ(pyramid_of(image, 3).front().pixels, image.pixels);
  EXPECT_EQ(pyramid_of(image, 1).size(), 1u);
}

TEST(Pyramid, TheCentreOfAPixelOfALevelIsTheCentreOfThoseBelow) {
  EXPECT_EQ(at_level({0.5, 0.5}, 1), Eigen::Vector2d(0, 0));
  EXPECT_EQ(at_level({2 * 7 + 0.5, 2 * 3 + 0.5}, 1), Eigen::Vector2d(7, 3));
  EXPECT_EQ(at_level({1.5, 1.5}, 2), Eigen::Vector2d(0, 0));
  EXPECT_EQ(at_level({3, 4}, 0), Eigen::Vector2d(3, 4));
}

TEST(Grey, WeighsColoursAsTheStandardSays) {
  const Image image{5, 1, 3, {255, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255}};
  const GreyImage grey = to_grey(image);
  EXPECT_EQ(grey.width, 5);
  EXPECT_EQ(grey.height, 1);
  EXPECT_EQ(grey.pixels, (std::vector<std::uint8_t>{255, 0, 77, 149, 29}));
}

TEST(Grey, IsWithinOneOfTheExactSum) {
  test::Random random(5);
  Image image{101, 7, 3, {}};
  for (int i = 0; i < 101 * 7 * 3; ++i) image.pixels.push_back(static_cast<std::uint8_t>(random.uniform(0, 255.999)));
  const GreyImage grey = to_grey(image);
  ASSERT_EQ(grey.pixels.size(), 101u * 7u);
  for (std::size_t i = 0; i < grey.pixels.size(); ++i) {
    const double exact = 0.299 * image.pixels[3 * i] + 0.587 * image.pixels[3 * i + 1] + 0.114 * image.pixels[3 * i + 2];
    EXPECT_NEAR(grey.pixels[i], exact, 1);
  }
}

TEST(Grey, AGreyImageStaysAsItIs) {
  const Image image{3, 2, 1, {1, 2, 3, 4, 5, 6}};
  EXPECT_EQ(to_grey(image).pixels, image.pixels);
  EXPECT_EQ(to_grey(image).width, 3);
  EXPECT_TRUE(to_grey(Image{}).pixels.empty());
}

TEST(Sample, IsBilinearBetweenPixels) {
  const GreyImage image{3, 2, {10, 20, 60, 30, 80, 0}};
  EXPECT_FLOAT_EQ(sample(image.pixels.data(), image.width, 0, 0), 10);
  EXPECT_FLOAT_EQ(sample(image.pixels.data(), image.width, 0.25F, 0), 12.5F);
  EXPECT_FLOAT_EQ(sample(image.pixels.data(), image.width, 0, 0.5F), 20);
  EXPECT_FLOAT_EQ(sample(image.pixels.data(), image.width, 0.5F, 0.5F), 35);
  EXPECT_FLOAT_EQ(sample(image.pixels.data(), image.width, 1.5F, 0.5F), 40);
}

}  // namespace pyramid_test
}  // namespace kilvo
