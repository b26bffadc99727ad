#include "kilvo/estimator/world_map.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/exact_map.hpp"

namespace kilvo {
namespace world_map_test {

// What a robot 1 m above a floor of 10 m by 10 m sees of it, and how it has been registered.
Registration floor_sweep() {
  Registration out;
  out.posterior.x.p = {0, 0, 1};
  out.posterior.P.diagonal().setConstant(1e-6);
  for (const Eigen::Vector3d& x : test::points_on({-5, -5, -1}, {10, 0, 0}, {0, 10, 0}, 0.05))
    out.points.emplace_back(x.cast<float>().x(), x.cast<float>().y(), x.cast<float>().z(), 0);
  out.clusters = downsample(out.points, out.posterior.x.pose(), LidarConfig{}.voxel_size);
  out.carries = true;
  return out;
}

WorldMap empty_world() { return {MapConfig{}, LidarConfig{}, Eigen::Vector3d::Zero()}; }

PoseCovariance none() { return PoseCovariance::Zero(); }

TEST(WorldMap, GrowsByASweepOnlyWhereItMay) {
  WorldMap map = empty_world();
  map.learn(floor_sweep(), none(), false);
  EXPECT_TRUE(map.surfaces().empty());
  map.learn(floor_sweep(), none(), true);
  EXPECT_FALSE(map.surfaces().empty());
  const Plane* floor = map.surfaces().plane_at({1, 1, 0});
  ASSERT_NE(floor, nullptr);
  EXPECT_NEAR(std::abs(floor->normal.z()), 1, 1e-3);
}

TEST(WorldMap, AGivenOneStaysAsItIs) {
  WorldMap map = empty_world();
  const lab::Rectangle wall = {{3, -2, 0}, {0, 4, 0}, {0, 0, 3}};
  map.give(test::exact_map({wall}, SE3()));
  const std::size_t before = map.surfaces().node_count();
  map.learn(floor_sweep(), none(), true);
  EXPECT_TRUE(map.is_given());
  EXPECT_EQ(map.surfaces().node_count(), before);
  EXPECT_EQ(map.surfaces().plane_at({1, 1, 0}), nullptr);
}

// Nothing told how far away the robot is: metres along the ground, a metre up, a turn about the vertical; but up is what gravity says.
TEST(WorldMap, BegunAnewItIsEmptyAndTheUncertaintySaysSo) {
  for (const SO3& R : {SO3(), SO3::Exp({0.4, -0.3, 0}) * SO3::Exp({0, 0, 1.2})}) {
    WorldMap map = empty_world();
    map.learn(floor_sweep(), none(), true);
    Estimate e = floor_sweep().posterior;
    e.x.R = R;
    e.x.p = {4, -3, 1};
    const PoseCovariance before = map.error_at(e.x.pose());
    map.begin_anew(e);
    EXPECT_TRUE(map.surfaces().empty());
    const PoseCovariance grown = map.error_at(e.x.pose()) - before;
    EXPECT_NEAR(std::sqrt(grown(3, 3)), 5, 1e-6);
    EXPECT_NEAR(std::sqrt(grown(4, 4)), 5, 1e-6);
    EXPECT_NEAR(std::sqrt(grown(5, 5)), 1, 1e-6);
    const Eigen::Matrix3d turned_W = R.matrix() * grown.topLeftCorner<3, 3>() * R.matrix().transpose();
    EXPECT_NEAR(std::sqrt(turned_W(2, 2)), 0.5, 1e-6);
    EXPECT_NEAR(turned_W.topLeftCorner(2, 2).norm(), 0, 1e-9);
  }
}

// What the pose was uncertain by against the map before is the new map's error, and none against it.
TEST(WorldMap, BegunAnewItBeginsAFrameWithItsFirstSweep) {
  Estimate e = floor_sweep().posterior;
  e.x.g = {0, 0, -standard_gravity};
  e.P.diagonal().segment<3>(at::p).setConstant(10.0 * 10.0);
  e.P(at::R + 2, at::R + 2) = 1;
  const Covariance P = e.P;
  WorldMap map = empty_world();
  map.begin_frame_at(e);
  EXPECT_EQ(e.P, P) << "the first map of all";
  map.begin_anew(e);
  map.begin_frame_at(e);
  EXPECT_LT((e.P.block<3, 3>(at::p, at::p).norm()), 1e-12);
  EXPECT_LT(e.P(at::R + 2, at::R + 2), 1e-12);
  EXPECT_NEAR(e.P(at::R, at::R), P(at::R, at::R), 1e-12) << "gravity still says what is up";
  EXPECT_NEAR(map.error_at(e.x.pose())(3, 3), 5.0 * 5.0 + 10.0 * 10.0, 1e-3);
  map.learn(floor_sweep(), none(), true);
  e.P = P;
  map.begin_frame_at(e);
  EXPECT_EQ(e.P, P) << "the second sweep";
}

TEST(WorldMap, ASweepThatIsRefusedBeginsNoFrame) {
  Estimate e = floor_sweep().posterior;
  e.x.g = {0, 0, -standard_gravity};
  e.P.diagonal().segment<3>(at::p).setConstant(10.0 * 10.0);
  WorldMap map = empty_world();
  map.begin_anew(e);
  LidarPipeline lidar(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
  History history{EstimatorConfig()};
  history.begin(e, std::nullopt);
  PointDrops drops;
  for (int k = 0; k < 3; ++k) {
    Estimate prior = e;
    EXPECT_EQ(map.register_sweep(lidar, {LidarScan{}, e.t}, history, prior, drops).refused, Reason::no_usable_point);
  }
  EXPECT_NEAR(map.error_at(e.x.pose())(3, 3), 5.0 * 5.0, 1e-3);
}

// The new map's planes carry that error: however many sweeps are registered to them, they tell nothing of the one before.
TEST(WorldMap, WhatIsRegisteredToANewMapStaysAsUncertainAsThat) {
  WorldMap map = empty_world();
  const Registration first = floor_sweep();
  map.begin_anew(first.posterior);
  for (int k = 0; k < 20; ++k) {
    Registration sweep = floor_sweep();
    const auto of_epoch = [&sweep](const VoxelMap::Match& m) {
      sweep.by_epoch = {{m.epoch, 1e6 * PoseCovariance::Identity()}};
      return true;
    };
    EXPECT_EQ(map.surfaces().visit_planes({1, 1, 0}, of_epoch), k > 0);
    map.learn(sweep, none(), true);
  }
  EXPECT_GT(std::sqrt(map.error_at(first.posterior.x.pose())(3, 3)), 4.9);
  map.begin_anew(first.posterior);
  EXPECT_GT(std::sqrt(map.error_at(first.posterior.x.pose())(3, 3)), 6.9) << "lost twice";
}

// Along a corridor the legs' description makes an error that the filter's covariance lacks: planes that were seen there have it.
TEST(WorldMap, PlanesCarryWhatTheDescriptionMayBeOffByWhereNoSweepMeasures) {
  WorldMap map = empty_world();
  PoseCovariance along = none();
  along(3, 3) = 1;
  Registration sweep = floor_sweep();
  sweep.considered.diagonal().tail<3>().setConstant(0.1 * 0.1);
  map.learn(sweep, along, true);
  map.surfaces().visit_planes({1, 1, 0}, [&sweep](const VoxelMap::Match& m) {
    sweep.by_epoch = {{m.epoch, 1e6 * PoseCovariance::Identity()}};
    return true;
  });
  map.learn(sweep, none(), true);
  const PoseCovariance error = map.error_at(sweep.posterior.x.pose());
  EXPECT_NEAR(std::sqrt(error(3, 3)), 0.1, 0.005);
  EXPECT_LT(std::sqrt(error(4, 4)), 0.01) << "was measured";
}

}  // namespace world_map_test
}  // namespace kilvo
