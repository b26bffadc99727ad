#include "kilvo/legs/ground.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>

#include "tests/helpers/surface_groups.hpp"

namespace kilvo {
namespace ground_test {

using Eigen::Vector3d;

const Vector3d up = Vector3d::UnitZ();

// A square of `edge` around `centre`, rising along x by `slope` degrees.
VoxelMap floor_of(const Vector3d& centre, double slope_deg, double edge = 4) {
  const double a = slope_deg * M_PI / 180;
  const Vector3d u = edge * Vector3d(std::cos(a), 0, std::sin(a)), v(0, edge, 0);
  const MapConfig config;
  VoxelMap map(config);
  const auto groups = test::groups_of(test::points_on(centre - 0.5 * (u + v), u, v, 0.03), config.voxel_size / 4, 1e-5);
  for (int i = 0; i < 3; ++i) map.insert(groups, 0);
  return map;
}

double steepness(const GroundPatch& patch) { return std::acos(std::min(1.0, patch.normal.dot(up))) * 180 / M_PI; }

TEST(Ground, OfTheMapIsThePlaneUnderTheFootAtAnyHeightAndUpToThirtyDegrees) {
  for (const double z : {-1.0, -0.02, 0.0, 0.5, 0.98, 7.3}) {
    for (const double slope : {0.0, 6.0, 15.0, 28.0}) {
      SCOPED_TRACE(testing::Message() << z << " m, " << slope << " degrees");
      const VoxelMap map = floor_of({0.3, 0.4, z}, slope);
      for (const double off : {-0.04, 0.0, 0.04}) {
        const double x = 0.17, height = z + (x - 0.3) * std::tan(slope * M_PI / 180);
        const auto patch = GroundLookup::of_map(map, {x, 0.1, height + off}, up);
        ASSERT_TRUE(patch);
        EXPECT_NEAR(patch->height_of({x, 0.1, height + off}), off * std::cos(slope * M_PI / 180), 0.004);
        EXPECT_NEAR(steepness(*patch), slope, 1);
        EXPECT_LT(patch->sigma, 0.01);
      }
    }
  }
}

TEST(Ground, OfTheMapIsNoWallNoSteepRoofAndNothingFarBelow) {
  EXPECT_FALSE(GroundLookup::of_map(floor_of({0, 0, 0}, 40), {0, 0, 0}, up));
  EXPECT_FALSE(GroundLookup::of_map(floor_of({0, 0, 0}, 90), {0, 0, 0}, up));
  EXPECT_FALSE(GroundLookup::of_map(floor_of({0, 0, 0.1}, 0), {0, 0, 0.5}, up));
  EXPECT_FALSE(GroundLookup::of_map(VoxelMap(MapConfig{}), {0, 0, 0}, up));
  EXPECT_TRUE(GroundLookup::of_map(floor_of({0, 0, 0}, 40), {0, 0, 0}, Vector3d(-std::sin(0.6), 0, std::cos(0.6)))) << "up decides";
}

// Where steps of `length` come down on ground of height f(x), left and right in turn.
GroundLookup walked(int steps, double length, double (*height)(double)) {
  GroundLookup ground;
  for (int i = 0; i < steps; ++i) ground.stands_at({length * i, i % 2 == 0 ? 0.1 : -0.1, height(length * i)});
  return ground;
}

TEST(Ground, OfContactsNeedsOneAndIsLevelUntilTheyTellMore) {
  GroundLookup ground;
  EXPECT_FALSE(ground.of_contacts(up));
  ground.stands_at({1, 2, 3});
  ASSERT_TRUE(ground.of_contacts(up));
  EXPECT_NEAR(ground.of_contacts(up)->height_of({1, 2, 3.2}), 0.2, 1e-12);
  ground.stands_at({1, 1.8, 3});
  EXPECT_LT(steepness(*ground.of_contacts(up)), 0.1);
  ground.forget();
  EXPECT_FALSE(ground.of_contacts(up));
}

TEST(Ground, OfContactsFollowsASlopeUpAndDown) {
  for (const double slope : {-28.0, -6.0, 6.0, 15.0, 28.0}) {
    GroundLookup ground;
    const double rise = std::tan(slope * M_PI / 180);
    for (int i = 0; i < 6; ++i) ground.stands_at({0.3 * i, i % 2 == 0 ? 0.1 : -0.1, 5 + 0.3 * i * rise});
    const auto patch = ground.of_contacts(up);
    ASSERT_TRUE(patch);
    EXPECT_NEAR(steepness(*patch), std::abs(slope), 1.5);
    EXPECT_NEAR(patch->height_of({1.8, 0, 5 + 1.8 * rise}), 0, 0.015) << "the next step";
  }
}

TEST(Ground, OfContactsIsReleasedWhereARampBeginsAndOnAStair) {
  const GroundLookup ramp = walked(5, 0.35, [](double x) { return x < 1.2 ? 0.0 : (x - 1.2) * std::tan(0.2); });
  const double end = 0.35 * 4, height = (end - 1.2) * std::tan(0.2);
  EXPECT_NEAR(ramp.of_contacts(up)->height_of({end, 0.1, height}), 0, 0.01) << "it goes through the newest contact";
  const GroundLookup stairs = walked(5, 0.28, [](double x) { return 0.15 * std::floor(x / 0.28 + 0.5); });
  EXPECT_NEAR(stairs.of_contacts(up)->height_of({0.28 * 4, 0.1, 0.6}), 0, 0.01);
}

TEST(Ground, UnderAFootIsTheMapsAndWithoutOneThatOfTheContacts) {
  const VoxelMap map = floor_of({0, 0, 0}, 10);
  GroundLookup ground;
  ground.stands_at({0, 0, 0});
  EXPECT_NEAR(steepness(*ground.under(&map, {0.1, 0.1, 0.0}, up)), 10, 1);
  EXPECT_LT(steepness(*ground.under(nullptr, {0.1, 0.1, 0.0}, up)), 0.1);
  EXPECT_LT(steepness(*ground.under(&map, {30, 0, 0}, up)), 0.1) << "beyond the map";
}

}  // namespace ground_test
}  // namespace kilvo
