#include "lab/mapping/map_builder.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>

namespace kilvo::lab {
namespace map_builder_test {

using Points = std::vector<Eigen::Vector4f>;

/// A square plane at height z with points 1 cm apart, in rows from corner to corner.
Points plane(double edge, double z) {
  Points points;
  const int n = static_cast<int>(std::lround(edge / 0.01));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      points.emplace_back(static_cast<float>(0.01 * i + 0.005), static_cast<float>(0.01 * j + 0.005), static_cast<float>(z), 50.0F);
  return points;
}

Points scattered(std::size_t count, float extent, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-extent, extent);
  Points points(count);
  for (auto& p : points) p = {uniform(random), uniform(random), uniform(random), uniform(random)};
  return points;
}

Points content(const MapBuilder& map) {
  Points points;
  for (std::size_t i = 0; i < map.size(); ++i) points.push_back(map.point(i));
  return points;
}

TEST(MapBuilder, KeepsOnePointPerVoxelOfAPlaneAtTheMeanOfItsPoints) {
  MapBuilder map;
  map.add(plane(10, 0.02));
  ASSERT_EQ(map.size(), 200u * 200u);
  for (const auto& p : content(map)) {
    // 5 x 5 points lie evenly in each voxel: their mean is its middle.
    ASSERT_NEAR(std::remainder(p.x() - 0.025, 0.05), 0, 1e-5);
    ASSERT_NEAR(std::remainder(p.y() - 0.025, 0.05), 0, 1e-5);
    ASSERT_NEAR(p.z(), 0.02, 1e-6);
    ASSERT_FLOAT_EQ(p[3], 50);
  }
}

TEST(MapBuilder, KeepsTheVoxelsThatASetWouldKeep) {
  const auto points = scattered(50000, 0.8F, 1);
  std::set<std::tuple<double, double, double>> voxels;
  for (const auto& p : points) voxels.emplace(std::floor(p.x() / 0.05), std::floor(p.y() / 0.05), std::floor(p.z() / 0.05));
  MapBuilder map;
  map.add(points);
  EXPECT_EQ(map.size(), voxels.size());
  for (const auto& p : content(map)) voxels.erase({std::floor(p.x() / 0.05), std::floor(p.y() / 0.05), std::floor(p.z() / 0.05)});
  EXPECT_TRUE(voxels.empty());
}

TEST(MapBuilder, ResolutionIsTheEdgeOfTheVoxels) {
  for (const auto& [resolution, expected] : {std::pair{0.1, 100u * 100u}, {0.5, 20u * 20u}, {20.0, 1u}}) {
    MapBuilder map({.resolution = resolution});
    map.add(plane(10, 0.02));
    EXPECT_EQ(map.size(), expected);
  }
}

TEST(MapBuilder, AveragesNoiseAwayAndThenStaysStill) {
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 0.005F);
  MapBuilder map;
  double squares = 0;
  constexpr int voxels = 400;
  for (int v = 0; v < voxels; ++v)
    for (int i = 0; i < 32; ++i) map.add(Points{{static_cast<float>(v) * 0.05F + 0.025F, 0.025F, 0.025F + noise(random), 10}});
  for (const auto& p : content(map)) squares += std::pow(p.z() - 0.025, 2);
  EXPECT_EQ(map.size(), static_cast<std::size_t>(voxels));
  EXPECT_NEAR(std::sqrt(squares / voxels), 0.005 / std::sqrt(32.0), 0.0001);
  const auto before = content(map);
  for (int v = 0; v < voxels; ++v)
    map.add(Points{{static_cast<float>(v) * 0.05F + 0.025F, 0.025F, 0.045F, 99}});  // a pass that has drifted
  EXPECT_EQ(content(map), before);
}

TEST(MapBuilder, ALonePointIsKeptToTheMicrometre) {
  MapBuilder map;
  const auto points = scattered(1000, 100, 3);
  map.add(points);
  ASSERT_EQ(map.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LT((map.point(i) - points[i]).head<3>().cwiseAbs().maxCoeff(), 8e-6F);  // a float at 100 m has steps of 8 um
    ASSERT_EQ(map.point(i)[3], points[i][3]);
  }
}

TEST(MapBuilder, HoldsAWorldOfKilometres) {
  MapBuilder map;
  map.add(Points{{40000, -40000, 3000, 1}, {40000.04F, -40000, 3000, 1}, {40001, -40000, 3000, 1}, {-40000, 40000, -3000, 1}});
  ASSERT_EQ(map.size(), 3u);
  EXPECT_NEAR(map.point(0).x(), 40000, 0.03);
  EXPECT_NEAR(map.point(2).x(), -40000, 0.01);
  EXPECT_EQ(map.dropped(), 0u);
}

TEST(MapBuilder, DropsAndCountsWhatIsOutsideOrNotFinite) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  MapBuilder map;
  map.add(Points{{nan, 0, 0, 1},
                 {0, inf, 0, 1},
                 {0, 0, -inf, 1},
                 {0, 0, 0, nan},
                 {60000, 0, 0, 1},
                 {0, 0, -60000, 1},
                 {1e30F, 0, 0, 1},
                 {1, 2, 3, 4}});
  EXPECT_EQ(map.dropped(), 7u);
  EXPECT_EQ(map.size(), 1u);
  map.add({});
  EXPECT_EQ(map.size(), 1u);
}

TEST(MapBuilder, NegativeCoordinatesHaveVoxelsOfTheirOwn) {
  MapBuilder map;
  map.add(Points{{0.01F, 0.01F, 0.01F, 1}, {-0.01F, 0.01F, 0.01F, 1}, {0.01F, -0.01F, 0.01F, 1}, {0.01F, 0.01F, -0.01F, 1}});
  EXPECT_EQ(map.size(), 4u);
}

TEST(MapBuilder, DoesNotDependOnHowThePointsAreCutIntoCalls) {
  const auto points = scattered(100000, 2, 4);
  MapBuilder whole, pieces;
  whole.add(points);
  for (std::size_t begin = 0, step = 1; begin < points.size(); begin += step, step = step * 7 % 1000 + 1)
    pieces.add(std::span(points).subspan(begin, std::min(step, points.size() - begin)));
  EXPECT_EQ(content(whole), content(pieces));
}

TEST(MapBuilder, NeedsLessThanFortyBytesPerPointOfALargeMap) {
  MapBuilder map;
  std::size_t most = 0;
  for (unsigned i = 0; i < 50; ++i) {
    map.add(scattered(20000, 200, 10 + i));
    if (map.size() > 100000) most = std::max(most, map.memory_bytes() / map.size());
  }
  EXPECT_GT(map.size(), 990000u);
  EXPECT_LE(most, 24u + 16u);
}

TEST(MapBuilder, RefusesAResolutionThatIsNoLength) {
  for (const double resolution : {0.0, -0.05, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(MapBuilder({.resolution = resolution}), std::invalid_argument);
  }
}

using Colours = std::vector<ColouredPoint>;
using Rgb = std::array<std::uint8_t, 3>;

MapBuilder one_point() {
  MapBuilder map;
  map.add(Points{{1.02F, 2.02F, 3.02F, 7}});
  return map;
}

ColouredPoint there(Rgb rgb, float weight) { return {{1.04F, 2.01F, 3.03F}, rgb, weight}; }

TEST(MapColours, GoToTheVoxelThatAPointFallsInto) {
  MapBuilder map;
  map.add(Points{{0.01F, 0.01F, 0.01F, 1}, {-0.01F, 0.01F, 0.01F, 2}, {0.06F, 0.01F, 0.01F, 3}});
  const auto before = content(map);
  EXPECT_EQ(map.coloured(), 0u);
  map.colour(Colours{{{0.04F, 0.04F, 0.04F}, {10, 20, 30}, 1}, {{-0.04F, 0.04F, 0.04F}, {255, 0, 1}, 0.2F}});
  EXPECT_EQ(map.colour_of(0), (Rgb{10, 20, 30}));
  EXPECT_EQ(map.colour_of(1), (Rgb{255, 0, 1}));
  EXPECT_EQ(map.colour_of(2), std::nullopt);
  EXPECT_EQ(map.coloured(), 2u);
  EXPECT_EQ(content(map), before);
}

TEST(MapColours, WhereTheMapHasNoPointThereIsNothingToColour) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  MapBuilder map = one_point();
  map.colour(Colours{
      {{1.06F, 2.01F, 3.03F}, {1, 2, 3}, 1}, {{nan, 2, 3}, {1, 2, 3}, 1}, {{inf, 2, 3}, {1, 2, 3}, 1}, {{1e9F, 2, 3}, {1, 2, 3}, 1}});
  for (const float weight : {0.0F, -1.0F, nan}) map.colour(Colours{there({1, 2, 3}, weight)});
  EXPECT_EQ(map.coloured(), 0u);
  EXPECT_EQ(map.size(), 1u);
  EXPECT_EQ(map.dropped(), 0u);
  MapBuilder empty;
  empty.colour(Colours{there({1, 2, 3}, 1)});
  EXPECT_EQ(empty.size(), 0u);
}

TEST(MapColours, AreTheMeanByWeight) {
  for (const float scale : {1e-3F, 1.0F, 300.0F}) {  // only ratios matter
    MapBuilder map = one_point();
    map.colour(Colours{there({100, 0, 250}, scale)});
    map.colour(Colours{there({200, 100, 50}, 3 * scale)});
    EXPECT_EQ(map.colour_of(0), (Rgb{175, 75, 100}));
    map.colour(Colours{there({0, 0, 0}, 0.04F * scale)});  // a poor image says little
    EXPECT_EQ(map.colour_of(0), (Rgb{173, 74, 99}));
    map.colour(Colours{there({40, 200, 10}, 400 * scale)});  // a much better one nearly all
    EXPECT_EQ(map.colour_of(0), (Rgb{41, 199, 11}));
    EXPECT_EQ(map.coloured(), 1u);
  }
}

TEST(MapColours, AverageTheNoiseOfManyImagesAway) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(120, 20);
  MapBuilder map = one_point();
  for (int i = 0; i < 50; ++i) {
    const auto value = static_cast<std::uint8_t>(noise(random));
    map.colour(Colours{there({value, 7, 255}, 1)});
  }
  const Rgb mean = *map.colour_of(0);
  EXPECT_NEAR(mean[0], 120, 3 * 20 / std::sqrt(50.0));
  EXPECT_EQ(mean[1], 7);
  EXPECT_EQ(mean[2], 255);
}

TEST(MapColours, ForgetAtLastWhatManyImagesSaid) {
  MapBuilder map = one_point();
  for (int i = 0; i < 5000; ++i) map.colour(Colours{there({200, 200, 0}, 1)});
  map.colour(Colours{there({10, 10, 10}, 1)});
  EXPECT_GE((*map.colour_of(0))[0], 196);
  for (int i = 0; i < 64; ++i) map.colour(Colours{there({10, 10, 10}, 1)});
  EXPECT_NEAR((*map.colour_of(0))[0], 10 + 190 / std::exp(1), 5);
  for (int i = 0; i < 1000; ++i) map.colour(Colours{there({10, 10, 10}, 1)});
  EXPECT_EQ(map.colour_of(0), (Rgb{10, 10, 10}));
}

TEST(MapColours, TakeWeightsOfAnySizeWithoutLosingThemselves) {
  MapBuilder map = one_point();
  map.colour(Colours{there({5, 6, 7}, std::numeric_limits<float>::denorm_min())});
  EXPECT_EQ(map.colour_of(0), (Rgb{5, 6, 7}));
  for (int i = 0; i < 200; ++i) map.colour(Colours{there({50, 60, 70}, std::numeric_limits<float>::infinity())});
  EXPECT_EQ(map.colour_of(0), (Rgb{50, 60, 70}));
}

TEST(MapColours, DoNotDependOnHowTheyAreCutIntoCalls) {
  const auto points = scattered(20000, 1, 6);
  MapBuilder whole, pieces;
  whole.add(points);
  pieces.add(points);
  std::mt19937 random(7);
  Colours colours;
  for (const auto& p : scattered(60000, 1, 8)) {
    const auto byte = [&] { return static_cast<std::uint8_t>(random()); };
    colours.push_back({p.head<3>(), {byte(), byte(), byte()}, std::abs(p[3])});
  }
  whole.colour(colours);
  for (std::size_t begin = 0, step = 1; begin < colours.size(); begin += step, step = step * 7 % 1000 + 1)
    pieces.colour(std::span(colours).subspan(begin, std::min(step, colours.size() - begin)));
  EXPECT_GT(whole.coloured(), 8000u);
  EXPECT_EQ(whole.coloured(), pieces.coloured());
  for (std::size_t i = 0; i < whole.size(); ++i) ASSERT_EQ(whole.colour_of(i), pieces.colour_of(i));
}

TEST(MapColours, CostEightBytesPerPointAndNothingWithoutImages) {
  MapBuilder map;
  for (unsigned i = 0; i < 20; ++i) map.add(scattered(20000, 200, 30 + i));
  const std::size_t plain = map.memory_bytes();
  map.colour({});
  EXPECT_EQ(map.memory_bytes(), plain);
  Colours colours;
  for (std::size_t i = 0; i < map.size(); ++i) colours.push_back({map.point(i).head<3>(), {1, 2, 3}, 1});
  map.colour(colours);
  EXPECT_GT(map.coloured(), map.size() - 20);  // rounding moves a point over the face of its voxel
  EXPECT_LE(map.memory_bytes() - plain, 8 * (map.size() + 32768) + 4096);
  EXPECT_LE(map.memory_bytes() / map.size(), 24u + 16u + 8u);
}

TEST(MapBuilder, KeepsNoMoreThanItMayAndNothingWhenItIsSwitchedOff) {
  MappingConfig small;
  small.max_points = 100;
  MapBuilder map(small);
  std::vector<Eigen::Vector4f> line;
  for (int i = 0; i < 250; ++i) line.emplace_back(0.1F * static_cast<float>(i), 0, 0, 1);
  map.add(line);
  EXPECT_EQ(map.size(), 100u);
  EXPECT_EQ(map.left_out(), 150u);
  small.keep = false;
  MapBuilder none(small);
  none.add(line);
  EXPECT_EQ(none.size(), 0u);
}

}  // namespace map_builder_test
}  // namespace kilvo::lab
