#include "kilvo/map/visual_map.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace visual_map_test {

VisualPoint point_at(double x, double y = 0.1, double z = 0.1) {
  VisualPoint p;
  p.p_W = {x, y, z};
  return p;
}

Observation seen_in(std::uint32_t frame, float agreement = 1) {
  Observation o;
  o.frame = frame;
  o.agreement = agreement;
  return o;
}

std::vector<std::uint32_t> points_in(const VisualMap& map, const Eigen::Vector3d& x) {
  std::vector<std::uint32_t> out;
  map.visit(map.key_of(x), [&](std::uint32_t id, const VisualPoint&) { out.push_back(id); });
  return out;
}

TEST(VisualMap, APointIsFoundInItsVoxelAndInNoOther) {
  VisualMap map({});
  const std::uint32_t frame = map.add_frame({});
  for (const double x : {-0.7, -0.1, 0.1, 0.7}) ASSERT_TRUE(map.insert(point_at(x), seen_in(frame)));
  for (const double x : {-0.6, -0.2, 0.2, 0.6}) {
    const auto ids = points_in(map, {x, 0.3, 0.3});
    ASSERT_EQ(ids.size(), 1U) << x;
    EXPECT_LT(std::abs(map.point(ids[0]).p_W.x() - x), 0.2);
  }
  EXPECT_TRUE(points_in(map, {0.2, -0.3, 0.3}).empty());
}

TEST(VisualMap, AVoxelTakesSoManyPointsAndNoMore) {
  VisualMapConfig config;
  config.per_voxel = 3;
  VisualMap map(config);
  const std::uint32_t frame = map.add_frame({});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(map.insert(point_at(0.1 + 0.05 * i), seen_in(frame)));
  EXPECT_FALSE(map.insert(point_at(0.3), seen_in(frame)));
  EXPECT_EQ(map.size(), 3U);
  EXPECT_EQ(map.frame(frame).observations, 3U);
}

TEST(VisualMap, OfManyViewsTheFirstAndTheBestAreKept) {
  VisualMap map({});
  ASSERT_TRUE(map.insert(point_at(0.1), seen_in(map.add_frame({}), 0.1F)));
  const std::uint32_t id = points_in(map, {0.1, 0.1, 0.1}).at(0);
  for (const float agreement : {0.9F, 0.3F, 0.8F, 0.7F}) map.observe(id, seen_in(map.add_frame({}), agreement));
  const VisualPoint& p = map.point(id);
  ASSERT_EQ(p.count, VisualPoint::most_observations);
  std::vector<float> kept;
  for (std::size_t k = 0; k < p.count; ++k) kept.push_back(map.observation(p.observations[k]).agreement);
  EXPECT_EQ(kept, (std::vector<float>{0.1F, 0.9F, 0.8F, 0.7F}));
}

TEST(VisualMap, APointThatImagesKeepDenyingGoes) {
  VisualMap map({});
  const std::uint32_t frame = map.add_frame({});
  ASSERT_TRUE(map.insert(point_at(0.1), seen_in(frame)));
  ASSERT_TRUE(map.insert(point_at(0.2), seen_in(frame)));
  const std::uint32_t id = points_in(map, {0.1, 0.1, 0.1}).at(1);
  const std::uint32_t observation = map.point(id).observations[0];
  for (int i = 0; i < 4; ++i) map.judge(id, observation, false, 0.5F);
  map.judge(id, observation, true, 0.9F);
  for (int i = 0; i < 4; ++i) map.judge(id, observation, false, 0.5F);
  EXPECT_EQ(map.size(), 2U) << "an image in between agreed";
  map.judge(id, observation, false, 0.5F);
  EXPECT_EQ(map.size(), 1U);
  EXPECT_EQ(map.frame(frame).observations, 1U);
  const auto left = points_in(map, {0.1, 0.1, 0.1});
  ASSERT_EQ(left.size(), 1U);
  EXPECT_NE(left[0], id);
}

TEST(VisualMap, TheAgreementOfAViewFollowsTheImages) {
  VisualMap map({});
  ASSERT_TRUE(map.insert(point_at(0.1), seen_in(map.add_frame({}))));
  const std::uint32_t id = points_in(map, {0.1, 0.1, 0.1}).at(0);
  for (int i = 0; i < 40; ++i) map.judge(id, map.point(id).observations[0], true, 0.9F);
  EXPECT_NEAR(map.observation(map.point(id).observations[0]).agreement, 0.9F, 1e-3F);
}

TEST(VisualMap, WhatIsFarIsForgottenAndTheMemoryIsUsedAgain) {
  VisualMapConfig config;
  config.max_points = 100;
  VisualMap map(config);
  std::size_t memory = 0;
  for (int round = 0; round < 20; ++round) {
    const std::uint32_t frame = map.add_frame({});
    for (int i = 0; i < 50; ++i) ASSERT_TRUE(map.insert(point_at(50.0 * round + i), seen_in(frame)));
    map.forget({50.0 * round + 49, 0, 0}, 1000);
    ASSERT_LE(map.size(), 100U);
    if (round == 4) memory = map.memory_bytes();
  }
  EXPECT_EQ(map.memory_bytes(), memory);
  EXPECT_EQ(points_in(map, {999, 0.1, 0.1}).size(), 1U) << "the nearest are kept";
  map.forget({999, 0, 0}, 5.2);
  EXPECT_EQ(map.size(), 6U);
  map.forget({1e6, 0, 0}, 1);
  EXPECT_EQ(map.size(), 0U);
}

TEST(VisualMap, AFrameThatNothingWasTakenFromIsUsedAgain) {
  VisualMap map({});
  const std::uint32_t first = map.add_frame({});
  map.forget_unused_frame(first);
  EXPECT_EQ(map.add_frame({}), first);
  ASSERT_TRUE(map.insert(point_at(0.1), seen_in(first)));
  map.forget_unused_frame(first);
  EXPECT_NE(map.add_frame({}), first);
}

}  // namespace visual_map_test
}  // namespace kilvo
