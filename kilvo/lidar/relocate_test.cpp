#include "kilvo/lidar/relocate.hpp"

#include <gtest/gtest.h>

#include "lab/simulation/analytic_room.hpp"
#include "tests/helpers/exact_map.hpp"

namespace kilvo {
namespace relocate_test {

struct Place {
  lab::AnalyticRoom room{lab::AnalyticRoomConfig{}};
  SE3 truth = room.truth(room.start() + std::chrono::seconds(8));
  VoxelMap map = test::exact_map(room.surfaces(), SE3());
  Workers workers;

  // What a sweep from the true pose shows of all surfaces.
  std::vector<PointCluster> sweep() const {
    std::vector<PointCluster> out;
    for (const lab::Rectangle& r : room.surfaces()) {
      for (const Eigen::Vector3d& x : test::points_on(r.corner, r.u, r.v, 0.3)) {
        PointCluster c;
        c.mean = (truth.inverse() * x).cast<float>();
        c.count = 1;
        out.push_back(c);
      }
    }
    return out;
  }
  Estimate guess(const Eigen::Vector3d& off, double turned, double sigma, double sigma_yaw) const {
    Estimate e;
    e.x.p = truth.p + off;
    e.x.R = SO3::Exp(Eigen::Vector3d(0, 0, turned)) * truth.R;
    e.x.g = {0, 0, -9.80665};
    e.P.diagonal().setConstant(1e-6);
    e.P.diagonal().segment<3>(at::p) << sigma * sigma, sigma * sigma, 0.01;
    e.P.diagonal().segment<3>(at::R) << 1e-4, 1e-4, sigma_yaw * sigma_yaw;
    return e;
  }
};

TEST(Relocation, FindsAPoseThatIsOffByAMetreAndAQuarterOfARadian) {
  const Place place;
  for (const double side : {-1.0, 1.0}) {
    const Estimate e = place.guess({0.9 * side, -0.6, 0.1}, 0.25 * side, 0.5, 0.15);
    EXPECT_TRUE(needs_search(e.P, PoseCovariance::Identity()));
    const auto found = find_pose(place.map, place.sweep(), Eigen::Vector3d::Zero(), e, {}, place.workers);
    ASSERT_TRUE(found);
    EXPECT_LT((found->x.p - place.truth.p).norm(), 0.005);
    EXPECT_LT((found->x.R.inverse() * place.truth.R).Log().norm(), 0.002);
    EXPECT_GT(found->share, 0.9);
  }
}

// Seconds without an IMU: a walker may have turned round.
TEST(Relocation, LooksAllRoundWhereTheHeadingIsUnknown) {
  const Place place;
  for (const double turned : {-1.5, 2.2}) {
    const auto found =
        find_pose(place.map, place.sweep(), Eigen::Vector3d::Zero(), place.guess({0.5, -0.4, 0}, turned, 0.3, 0.8), {}, place.workers);
    ASSERT_TRUE(found);
    EXPECT_LT((found->x.p - place.truth.p).norm(), 0.005);
    EXPECT_LT((found->x.R.inverse() * place.truth.R).Log().norm(), 0.002);
  }
}

// Where the robot really is was not looked at: what a part of the sweep lies on is not it, however well that part lies.
TEST(Relocation, APlaceWithinASearchThatWasCutHasToExplainAllOfTheSweep) {
  const Place place;
  std::vector<PointCluster> sweep = place.sweep();
  for (std::size_t i = 0; i < sweep.size(); ++i) sweep[i].mean.z() += i % 20 < 9 ? 50.F : 0.F;  // where no surface is known
  const Estimate near = place.guess({0.3, 0, 0}, 0, 0.3, 0.1), cut = place.guess({0.3, 0, 0}, 0, 1.1, 0.1);
  const auto find = [&](const Estimate& e) { return find_pose(place.map, sweep, Eigen::Vector3d::Zero(), e, {}, place.workers); };
  EXPECT_TRUE(find(near));
  EXPECT_FALSE(find(cut));
}

TEST(Relocation, FindsNothingWhereTheSweepIsOfAnotherPlace) {
  const Place place;
  std::vector<PointCluster> sweep = place.sweep();
  for (std::size_t i = 0; i < sweep.size(); ++i) {
    sweep[i].mean += 0.8F * Eigen::Vector3f(std::sin(1.7F * static_cast<float>(i)), std::cos(2.3F * static_cast<float>(i)), 0.5F);
  }
  EXPECT_FALSE(find_pose(place.map, sweep, Eigen::Vector3d::Zero(), place.guess({0.3, 0, 0}, 0.1, 0.5, 0.15), {}, place.workers));
}

TEST(Relocation, TakesNoneOfTwoPlacesThatLookAlike) {
  // Two parallel walls and a floor: anywhere along them is as good.
  const Place place;
  const std::vector<lab::Rectangle> corridor = {
      {{-20, -1, 0}, {40, 0, 0}, {0, 0, 3}}, {{-20, 1, 0}, {40, 0, 0}, {0, 0, 3}}, {{-20, -1, 0}, {40, 0, 0}, {0, 2, 0}}};
  const VoxelMap map = test::exact_map(corridor, SE3());
  std::vector<PointCluster> sweep;
  for (const lab::Rectangle& r : corridor) {
    for (const Eigen::Vector3d& x : test::points_on(r.corner, r.u, r.v, 0.3)) {
      PointCluster c;
      c.mean = (x - Eigen::Vector3d(0, 0, 1)).cast<float>();
      c.count = 1;
      if (std::abs(x.x()) < 6) sweep.push_back(c);
    }
  }
  Estimate e = place.guess({0, 0, 0}, 0, 0.5, 0.05);
  e.x.p = {0.4, 0.1, 1};
  e.x.R = SO3();
  EXPECT_FALSE(find_pose(map, sweep, Eigen::Vector3d::Zero(), e, {}, place.workers));
}

TEST(Relocation, IsNotNeededAlongWhatSweepsDoNotKnow) {
  const Place place;
  const Estimate e = place.guess(Eigen::Vector3d::Zero(), 0, 2, 0.01);
  PoseCovariance known = PoseCovariance::Identity();
  EXPECT_TRUE(needs_search(e.P, known));
  known(3, 3) = known(4, 4) = 0;
  known(5, 5) = 0;
  EXPECT_FALSE(needs_search(e.P, known));
}

}  // namespace relocate_test
}  // namespace kilvo
