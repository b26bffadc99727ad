#include "kilvo/map/voxel_map.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <set>

#include "tests/helpers/random.hpp"
#include "tests/helpers/surface_groups.hpp"

namespace kilvo {
namespace voxel_map_test {

const Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX(), y_axis = Eigen::Vector3d::UnitY(), z_axis = Eigen::Vector3d::UnitZ();

constexpr double sigma = 0.002, spacing = 0.03, leaf = 0.25;

VoxelMap map_of(const std::vector<Eigen::Vector3d>& points, const MapConfig& config = {}) {
  VoxelMap map(config);
  map.insert(test::groups_of(points, leaf, sigma), 7);
  return map;
}

std::vector<Eigen::Vector3d> joined(std::vector<Eigen::Vector3d> a, const std::vector<Eigen::Vector3d>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

int planes_over(const VoxelMap& map, const Eigen::Vector3d& x) {
  int count = 0;
  map.visit_planes(x, [&count](const VoxelMap::Match&) {
    ++count;
    return false;
  });
  return count;
}

TEST(VoxelMap, AFloorIsOnePlanePerRootVoxelOnBothSidesOfZero) {
  const VoxelMap map = map_of(test::points_on({-2, -2, -0.3}, 4 * x_axis, 4 * y_axis, spacing));
  std::set<const Plane*> planes;
  for (double x = -1.95; x < 2; x += 0.1) {
    for (double y = -1.95; y < 2; y += 0.1) {
      const Plane* plane = map.plane_at({x, y, -0.3});
      ASSERT_NE(plane, nullptr) << x << " " << y;
      planes.insert(plane);
      EXPECT_LT(std::abs(plane->distance({x, y, -0.3})), 1e-6);
      EXPECT_NEAR(std::abs(plane->normal.z()), 1, 1e-6);
      EXPECT_LT((plane->centre - Eigen::Vector3d(std::floor(x) + 0.5, std::floor(y) + 0.5, -0.3)).norm(), 0.15);  // as of the last fit
    }
  }
  EXPECT_EQ(planes.size(), 16U);
  EXPECT_EQ(map.plane_at({0.5, 0.5, 0.5}), nullptr);
  EXPECT_EQ(map.plane_at({2.5, 0.5, -0.3}), nullptr);
}

TEST(VoxelMap, AVoxelHoldsItsLowerBorderAndNotItsUpper) {
  const VoxelMap map = map_of(test::points_on({0, 0, 0.5}, x_axis, y_axis, spacing));
  EXPECT_NE(map.plane_at({0, 0, 0.5}), nullptr);
  EXPECT_NE(map.plane_at({0.999999, 0, 0.5}), nullptr);
  EXPECT_EQ(map.plane_at({1, 0, 0.5}), nullptr);
  EXPECT_EQ(map.plane_at({-1e-12, 0, 0.5}), nullptr);
}

TEST(VoxelMap, AtAnEdgeOfTwoWallsBothAreFound) {
  // Floor at z = 0.1 and wall at x = 0.1 meet within one root voxel.
  const auto points =
      joined(test::points_on({0.1, 0, 0.1}, 0.9 * x_axis, y_axis, spacing), test::points_on({0.1, 0, 0.1}, 0.9 * z_axis, y_axis, spacing));
  VoxelMap map = map_of(points);
  map.insert(test::groups_of(points, leaf, sigma), 7);  // seen twice: what the first points seemed to be is no plane any more
  for (double away = 0.16; away < 0.9; away += 0.05) {
    for (double y = 0.1; y < 1; y += 0.2) {
      const Plane* floor = map.plane_at({0.1 + away, y, 0.1});
      const Plane* wall = map.plane_at({0.1, y, 0.1 + away});
      ASSERT_NE(floor, nullptr) << away;
      ASSERT_NE(wall, nullptr) << away;
      EXPECT_NEAR(std::abs(floor->normal.z()), 1, 1e-4) << away;
      EXPECT_NEAR(std::abs(wall->normal.x()), 1, 1e-4) << away;
    }
  }
}

TEST(VoxelMap, AMatchTellsItsPlaneItsNodeAndItsEpoch) {
  VoxelMap map = map_of(test::points_on({0, 0, 0.5}, x_axis, y_axis, spacing));
  map.insert(test::groups_of(test::points_on({1, 0, 0.5}, x_axis, y_axis, spacing), leaf, sigma), 9);
  map.insert(test::groups_of(test::points_on({0, 0, 0.5}, x_axis, y_axis, spacing), leaf, sigma), 11);  // seen again: still 7
  const auto first_at = [&map](const Eigen::Vector3d& x) {
    VoxelMap::Match found;
    map.visit_planes(x, [&found](const VoxelMap::Match& m) {
      found = m;
      return true;
    });
    return found;
  };
  EXPECT_EQ(first_at({0.2, 0.3, 0.5}).epoch, 7U);
  EXPECT_EQ(first_at({1.2, 0.3, 0.5}).epoch, 9U);
  EXPECT_EQ(first_at({0.2, 0.3, 0.5}).node, first_at({0.8, 0.9, 0.6}).node);
  EXPECT_NE(first_at({0.2, 0.3, 0.5}).node, first_at({1.8, 0.9, 0.6}).node);
  EXPECT_LT(first_at({1.2, 0.3, 0.5}).node, map.node_capacity());
}

TEST(VoxelMap, TheOrderOfInsertionDoesNotChangeThePlanes) {
  test::Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Matrix3d R = random.rotation().matrix();
    // Ten points per group and fifteen groups: the last fit (refit_growth) sees them all.
    std::vector<PointGroup> groups;
    for (int i = 0; i < 15; ++i) {
      PointGroup g;
      g.mean = Eigen::Vector3d(0.5, 0.5, 0.5) + random.uniform(-0.28, 0.28) * R.col(0) + random.uniform(-0.28, 0.28) * R.col(1);
      g.scatter = 10 * 0.02 * 0.02 * (Eigen::Matrix3d::Identity() - R.col(2) * R.col(2).transpose());
      g.noise = sigma * sigma * Eigen::Matrix3d::Identity();
      g.count = 10;
      groups.push_back(g);
    }
    VoxelMap forward{MapConfig{}}, backward{MapConfig{}};
    forward.insert(groups, 0);
    std::reverse(groups.begin(), groups.end());
    backward.insert(groups, 0);
    const Plane *a = forward.plane_at({0.5, 0.5, 0.5}), *b = backward.plane_at({0.5, 0.5, 0.5});
    ASSERT_TRUE(a != nullptr && b != nullptr);
    EXPECT_LT((a->centre - b->centre).norm(), 1e-9);
    EXPECT_LT(a->normal.cross(b->normal).norm(), 3e-7F);  // floats
    EXPECT_NEAR(a->offset_variance / b->offset_variance, 1, 1e-4);
    EXPECT_EQ(forward.node_count(), backward.node_count());
  }
}

TEST(VoxelMap, ASettledPlaneTakesNoMorePointsButOtherSurfacesStillFindTheirPlace) {
  const auto floor = test::groups_of(test::points_on({0, 0, 0.1}, x_axis, y_axis, spacing), leaf, sigma);
  VoxelMap map{MapConfig{}};
  for (int i = 0; i < 3; ++i) map.insert(floor, 0);  // 1156 points each
  const Plane before = *map.plane_at({0.5, 0.5, 0.1});
  const std::size_t nodes = map.node_count();
  // Biased within what the noise explains: would move the plane if it were taken.
  auto biased = floor;
  for (PointGroup& g : biased) g.mean.z() += 0.001;
  for (int i = 0; i < 20; ++i) map.insert(biased, 0);
  EXPECT_EQ(map.plane_at({0.5, 0.5, 0.1})->centre, before.centre);
  EXPECT_EQ(map.plane_at({0.5, 0.5, 0.1})->offset_variance, before.offset_variance);
  EXPECT_EQ(map.node_count(), nodes);
  // A wall in the same voxel.
  map.insert(test::groups_of(test::points_on({0.1, 0, 0.3}, 0.7 * z_axis, y_axis, spacing), leaf, sigma), 0);
  EXPECT_EQ(map.plane_at({0.5, 0.5, 0.1})->centre, before.centre);
  EXPECT_GE(planes_over(map, {0.1, 0.6, 0.8}), 2);
}

TEST(VoxelMap, APlaneKeepsTheSideThatItWasSeenFrom) {
  const auto wall = test::groups_of(test::points_on({0.5, 0, 0}, y_axis, z_axis, spacing), leaf, sigma);
  const Eigen::Vector3d on_wall(0.5, 0.5, 0.5);
  for (const double side : {-1, 1}) {
    VoxelMap map{MapConfig{}};
    for (int i = 0; i < 2; ++i) {
      // Half as many points again: the plane is fitted anew, seen from the other side this time.
      map.insert(wall, 0, Eigen::Vector3d(i == 0 ? 3 * side : -3 * side, 0, 1));
      map.visit_planes(on_wall, [&](const VoxelMap::Match& m) {
        EXPECT_TRUE(m.one_sided);
        EXPECT_GT(side * m.plane->normal.x(), 0.99F) << i;
        return true;
      });
      ASSERT_NE(map.plane_at(on_wall), nullptr);
    }
  }
  VoxelMap map{MapConfig{}};
  map.insert(wall, 0);
  map.visit_planes(on_wall, [&](const VoxelMap::Match& m) {
    EXPECT_FALSE(m.one_sided);
    return true;
  });
}

TEST(VoxelMap, TwoPlanesSeenOneAfterTheOtherAreToldApart) {
  VoxelMap map = map_of(test::points_on({0.1, 0, 0.1}, 0.9 * x_axis, y_axis, spacing));
  map.insert(test::groups_of(test::points_on({0.1, 0, 0.1}, 0.9 * z_axis, y_axis, spacing), leaf, sigma), 8);
  map.insert(test::groups_of(test::points_on({0.1, 0, 0.1}, 0.9 * x_axis, y_axis, spacing), leaf, sigma), 9);
  const Plane* wall = map.plane_at({0.1, 0.5, 0.8});
  ASSERT_NE(wall, nullptr);
  EXPECT_NEAR(std::abs(wall->normal.x()), 1, 1e-4);
  const Plane* floor = map.plane_at({0.8, 0.5, 0.1});
  ASSERT_NE(floor, nullptr);
  EXPECT_NEAR(std::abs(floor->normal.z()), 1, 1e-4);
}

TEST(VoxelMap, WhatIsFartherThanTheRadiusIsForgotten) {
  MapConfig config;
  config.radius = 10;
  VoxelMap map = map_of(test::points_on({-30, 0, 0.5}, 60 * x_axis, y_axis, 0.1), config);
  map.forget({8, 0.5, 0.5});
  for (double x = -29.5; x < 30; x += 1) {
    EXPECT_EQ(map.plane_at({x, 0.5, 0.5}) != nullptr, std::abs(x - 8) <= 10) << x;
  }
}

std::vector<PointGroup> surroundings(test::Random& random, const Eigen::Vector3d& centre, int count) {
  std::vector<PointGroup> groups;
  for (int i = 0; i < count; ++i) {
    PointGroup g;
    g.mean = centre + Eigen::Vector3d(random.uniform(-20, 20), random.uniform(-20, 20), random.uniform(-3, 3));
    g.scatter = 1e-4 * Eigen::Matrix3d::Identity();
    g.noise = 1e-4 * Eigen::Matrix3d::Identity();
    g.count = 3;
    groups.push_back(g);
  }
  return groups;
}

TEST(VoxelMap, MemoryIsBoundedOverTwoKilometresAndFreedNodesAreUsedAgain) {
  test::Random random(2);
  MapConfig config;
  config.radius = 15;
  config.max_nodes = 30000;
  VoxelMap map(config);
  std::size_t early = 0;
  for (int step = 0; step < 2000; ++step) {
    const Eigen::Vector3d centre(step - 1000.0, 0.3 * step, 0);
    map.insert(surroundings(random, centre, 500), 0);
    map.forget(centre);
    ASSERT_LE(map.node_count(), static_cast<std::size_t>(config.max_nodes));
    if (step == 200) early = map.memory_bytes();
  }
  EXPECT_LE(map.memory_bytes(), early + early / 4);
  EXPECT_LE(map.node_capacity(), static_cast<std::size_t>(config.max_nodes) + 1500 + 2048);
}

TEST(VoxelMap, TooManyNodesDriveOutTheFarthestFirst) {
  test::Random random(3);
  MapConfig config;
  config.max_nodes = 5000;
  VoxelMap map(config);
  map.insert(test::groups_of(test::points_on({-2, -2, 0.5}, 4 * x_axis, 4 * y_axis, 0.05), leaf, sigma), 0);
  map.insert(surroundings(random, {30, 0, 0}, 20000), 0);
  ASSERT_GT(map.node_count(), 5000U);
  for (int i = 0; i < 20; ++i) map.forget({0, 0, 0});
  EXPECT_LE(map.node_count(), 5000U);
  EXPECT_GT(map.node_count(), 3000U);
  EXPECT_NE(map.plane_at({0.5, 0.5, 0.5}), nullptr);
}

TEST(VoxelMap, PointsThatAreNowhereAreLeftOut) {
  VoxelMap map{MapConfig{}};
  PointGroup g;
  g.count = 10;
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e9, -1e9}) {
    g.mean = {1, bad, 2};
    map.insert(std::vector<PointGroup>{g}, 0);
  }
  g.mean = {1, 2, 3};
  g.count = 0;
  map.insert(std::vector<PointGroup>{g}, 0);
  EXPECT_TRUE(map.empty());
  EXPECT_EQ(map.node_count(), 0U);
}

// A LiDAR at the origin looks at a wall 6 m away; a box stands in between for 3 s, at ten sweeps a second.
struct SeenThrough {
  VoxelMap map{MapConfig{}};

  void sweep(const std::vector<Eigen::Vector3d>& points) {
    const std::vector<PointGroup> groups = test::groups_of(points, leaf, sigma);
    map.insert(groups, 1);
    map.see_through(Eigen::Vector3d::Zero(), test::means_of(groups));
  }
  // What a beam meets first.
  static std::vector<Eigen::Vector3d> scene(bool with_box) {
    std::vector<Eigen::Vector3d> out;
    for (double y = -3; y < 3; y += spacing) {
      for (double z = -1; z < 2; z += spacing) {
        // A hole in the wall, through which the next one is seen.
        const bool hole = std::abs(y - 1.6) < 0.5 && std::abs(z - 0.4) < 0.5;
        const Eigen::Vector3d wall = hole ? Eigen::Vector3d(9, 1.5 * y, 1.5 * z) : Eigen::Vector3d(6, y, z);
        const double t = 3.1 / wall.x();
        const bool box = with_box && std::abs(t * y) < 0.4 && std::abs(t * z) < 0.4;
        out.push_back(box ? Eigen::Vector3d(t * wall) : wall);
      }
    }
    return out;
  }
  int planes_of_box() const {
    int count = 0;
    for (double y = -0.35; y < 0.4; y += 0.1) {
      for (double z = -0.35; z < 0.4; z += 0.1) count += map.plane_at({3.1, y, z}) != nullptr ? 1 : 0;
    }
    return count;
  }
};

TEST(VoxelMap, ABoxThatIsGoneIsForgottenAfterTwoSecondsOfBeamsThroughIt) {
  SeenThrough seen;
  for (int i = 0; i < 30; ++i) seen.sweep(SeenThrough::scene(true));
  EXPECT_GT(seen.planes_of_box(), 40);
  for (int i = 0; i < 20; ++i) seen.sweep(SeenThrough::scene(false));
  EXPECT_EQ(seen.planes_of_box(), 0);
  EXPECT_NE(seen.map.plane_at({6, 0.3, 0.3}), nullptr);
}

TEST(VoxelMap, ThatSurfacesMoveIsSeenByThoseThatAreGoneSoonAndIsForgotten) {
  SeenThrough seen;
  const auto sweeps = [&](int count, bool with_box) {
    for (int i = 0; i < count; ++i) seen.sweep(SeenThrough::scene(with_box));
    return seen.map.moving_share();
  };
  const auto nothing_new = [&](int count) {
    for (int i = 0; i < count; ++i) seen.map.see_through({}, {});
    return seen.map.moving_share();
  };
  EXPECT_EQ(seen.map.moving_share(), 1);
  sweeps(2, false);
  EXPECT_LT(nothing_new(200), 0.03);
  sweeps(30, true);
  EXPECT_LT(sweeps(20, false), 0.03) << "a box that stood for 3 s";
  sweeps(8, true);
  EXPECT_EQ(sweeps(12, false), 1) << "one that stood for 0.8 s";
  EXPECT_LT(nothing_new(3000), 0.03) << "five minutes later";
}

TEST(VoxelMap, AWallAroundAHoleStays) {
  SeenThrough seen;
  for (int i = 0; i < 100; ++i) seen.sweep(SeenThrough::scene(false));
  int there = 0, all = 0;
  for (double y = -2.9; y < 2.9; y += 0.1) {
    for (double z = -0.9; z < 1.9; z += 0.1) {
      if (std::abs(y - 1.6) < 0.6 && std::abs(z - 0.4) < 0.6) continue;
      ++all;
      there += seen.map.plane_at({6, y, z}) != nullptr ? 1 : 0;
    }
  }
  EXPECT_EQ(there, all);
}

TEST(VoxelMap, AFloorUnderGrazingBeamsStays) {
  VoxelMap map{MapConfig{}};
  const auto groups = test::groups_of(test::points_on({-5, -5, -1}, 10 * x_axis, 10 * y_axis, 0.1), leaf, sigma);
  for (int i = 0; i < 50; ++i) {
    map.insert(groups, 1);
    map.see_through({0, 0, 0}, test::means_of(groups));
  }
  for (double x = -4.9; x < 5; x += 0.5) EXPECT_NE(map.plane_at({x, 0.5 * x, -1}), nullptr) << x;
}

}  // namespace voxel_map_test
}  // namespace kilvo
