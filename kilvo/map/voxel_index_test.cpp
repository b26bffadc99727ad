#include "kilvo/map/voxel_index.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <set>
#include <unordered_map>

namespace kilvo {
namespace voxel_index_test {

TEST(VoxelIndex, AgreesWithAnUnorderedMapOverAMillionRandomActions) {
  std::mt19937_64 random(1);
  VoxelIndex index;
  std::unordered_map<VoxelKey, std::uint32_t> oracle;
  const auto coordinate = [&random] { return static_cast<std::int64_t>(random() % 21) - 10; };
  for (std::uint32_t i = 0; i < 1'000'000; ++i) {
    const VoxelKey key = pack_key(coordinate(), coordinate(), coordinate());
    const auto found = oracle.find(key);
    ASSERT_EQ(index.find(key), found == oracle.end() ? no_index : found->second);
    // Phases of growth and of decline.
    const bool grow = random() % 10 < (i / 100'000 % 2 == 0 ? 8U : 2U);
    if (grow && found == oracle.end()) {
      index.insert(key, i);
      oracle.emplace(key, i);
    } else if (!grow) {
      index.erase(key);
      oracle.erase(key);
    }
    ASSERT_EQ(index.size(), oracle.size());
  }
  for (const auto& [key, value] : oracle) EXPECT_EQ(index.find(key), value);
  EXPECT_LE(2 * index.size(), index.capacity());
}

TEST(VoxelIndex, ErasingAllLeavesNothingAndNoTombstones) {
  VoxelIndex index;
  for (int round = 0; round < 100; ++round) {
    for (std::int64_t i = 0; i < 500; ++i) index.insert(pack_key(i, -i, round), static_cast<std::uint32_t>(i));
    for (std::int64_t i = 0; i < 500; ++i) index.erase(pack_key(i, -i, round));
    index.erase(pack_key(1, 2, 3));  // what is not there may be erased
  }
  EXPECT_EQ(index.size(), 0U);
  EXPECT_EQ(index.capacity(), 1024U);
}

TEST(PackKey, DistinguishesNeighboursOnBothSidesOfZeroAndAtTheBorders) {
  std::set<VoxelKey> keys;
  for (const std::int64_t x : {-1048576, -2, -1, 0, 1, 1048575}) {
    for (const std::int64_t y : {-1048576, -1, 0, 1, 1048575}) {
      for (const std::int64_t z : {-1048576, -1, 0, 1, 1048575}) keys.insert(pack_key(x, y, z));
    }
  }
  EXPECT_EQ(keys.size(), 150U);
}

TEST(FastFloor, IsFloorForBothSignsAndAtIntegers) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-1e6, 1e6);
  for (int i = 0; i < 100000; ++i) {
    const double x = uniform(random);
    ASSERT_EQ(fast_floor(x), static_cast<std::int64_t>(std::floor(x)));
  }
  for (const double x : {-2.0, -1.0, -0.0, 0.0, 1.0, 2.0, -1e-300, 1e-300, -0.5}) {
    EXPECT_EQ(fast_floor(x), static_cast<std::int64_t>(std::floor(x))) << x;
    EXPECT_EQ(fast_floor(std::nextafter(x, -1e9)), static_cast<std::int64_t>(std::floor(std::nextafter(x, -1e9)))) << x;
  }
}

}  // namespace voxel_index_test
}  // namespace kilvo
