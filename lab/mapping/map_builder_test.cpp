#include "lab/mapping/map_builder.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>

namespace kilvo::lab {
namespace {

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

}  // namespace
}  // namespace kilvo::lab
