#include "lab/simulation/world.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <map>

#include "lab/simulation/scenarios.hpp"
#include "lab/simulation/walk.hpp"

namespace kilvo::lab {
namespace world_test {

// How near anything comes to the middle of the pelvis and of the torso, sideways.
double nearest_wall(const World& world, const Walk& walk) {
  double nearest = 99;
  for (double t = 0; t < walk.end(); t += 0.4) {
    for (const Eigen::Vector3d& p : {walk.pelvis(t).p, Eigen::Vector3d(walk.torso(t) * Eigen::Vector3d(0, 0, 0.2))}) {
      for (double angle = 0; angle < 6.28; angle += 0.2) {
        if (const auto hit = world.cast(p, {std::cos(angle), std::sin(angle), 0})) nearest = std::min(nearest, hit->range);
      }
    }
  }
  return nearest;
}

TEST(World, NobodyWalksThroughFurniture) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    std::map<std::string, std::unique_ptr<World>> worlds;
    for (const Scenario& s : scenarios()) {
      if (s.name == "hour") continue;  // a walk where `square` walks, for long
      auto& made = worlds[s.world];
      if (!made) made = std::make_unique<World>(make_scene(s.world, seed), seed);
      const World& world = *made;
      EXPECT_GT(nearest_wall(world, Walk(BipedShape{}, world.ground(), s.start, s.stages)), 0.4) << s.name << " with seed " << seed;
    }
  }
}

TEST(World, AnUnknownNameIsRefused) { EXPECT_THROW(make_scene("moon", 1), std::invalid_argument); }

}  // namespace world_test
}  // namespace kilvo::lab
