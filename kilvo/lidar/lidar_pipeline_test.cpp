// What becomes of a sweep: when it carries the estimate, when the map may grow by it, when the robot is taken to be outside of the map.
#include "kilvo/lidar/lidar_pipeline.hpp"

#include <gtest/gtest.h>

#include "lab/simulation/analytic_room.hpp"
#include "tests/helpers/exact_map.hpp"

namespace kilvo {
namespace lidar_pipeline_test {

using std::chrono::milliseconds;

constexpr Time early{std::chrono::seconds(100)};

PoseCovariance no_error() { return PoseCovariance::Zero(); }

// A robot that stands in a room, and what its LiDAR says in a tenth of a second.
struct Standing {
  lab::AnalyticRoom room{[] {
    lab::AnalyticRoomConfig config;
    config.duration = 1;
    config.points_per_scan = 6000;
    return config;
  }()};
  LidarMount mount;
  LidarScan scan;
  Time end{};
  SE3 truth;
  Trajectory trajectory{std::chrono::seconds(1)};
  LidarPipeline pipeline;

  Standing() : mount(mounted()), pipeline(mount, LidarConfig{}, UpdateConfig{}, 1) {
    while (auto m = room.next()) {
      if (const auto* s = std::get_if<LidarScan>(&*m)) {
        scan = *s;
        break;
      }
    }
    end = scan.t + milliseconds(100);
    truth = room.truth(middle());
    trajectory.push(scan.t - milliseconds(50), truth, Eigen::Vector3d::Zero());
    trajectory.push(end + milliseconds(50), truth, Eigen::Vector3d::Zero());
  }
  static LidarMount mounted() {
    LidarMount out;
    out.T_imu_lidar = lab::AnalyticRoomConfig{}.T_imu_lidar;
    return out;
  }
  Time middle() const { return scan.t + milliseconds(50); }
  Estimate prior(const Eigen::Vector3d& off, double sigma) const {
    Estimate e;
    e.t = middle();
    e.x.R = truth.R;
    e.x.p = truth.p + off;
    e.P.diagonal().setConstant(1e-6);
    e.P.diagonal().segment<3>(at::p).setConstant(sigma * sigma);
    return e;
  }
  Registration measured(const VoxelMap& map, const Estimate& prior, const PoseCovariance& considered = no_error()) {
    PointDrops drops;
    return pipeline.measure(scan, {end, prior, trajectory, ProcessNoise{}, no_error(), false, considered}, map, drops);
  }
  VoxelMap whole() const { return test::exact_map(room.surfaces(), SE3()); }
};

void expect_untouched(const Estimate& a, const Estimate& b) {
  EXPECT_TRUE(boxminus(a.x, b.x).isZero(0)) << boxminus(a.x, b.x).transpose();
  EXPECT_TRUE((a.P - b.P).isZero(0));
}

TEST(LidarPipeline, ASweepOnAKnownMapCorrectsThePrior) {
  Standing s;
  const Estimate prior = s.prior({0.02, -0.015, 0.01}, 0.02);
  const Registration r = s.measured(s.whole(), prior);
  ASSERT_FALSE(r.refused);
  EXPECT_TRUE(r.carries);
  EXPECT_LT((r.posterior.x.p - s.truth.p).norm(), 0.003);
  EXPECT_FALSE(r.by_epoch.empty());
}

// Legs whose description is not exact have carried the robot for 30 m: the filter's covariance lacks that, and the walls are where they
// were.
TEST(LidarPipeline, ASweepMeetsTheWallsAsFarOffAsTheDescriptionMayBe) {
  Standing s;
  const Estimate prior = s.prior({0.1, 0, 0}, 0.01);
  PoseCovariance considered = no_error();
  considered(3, 3) = 0.1 * 0.1;
  const Registration without = s.measured(s.whole(), prior), with = s.measured(s.whole(), prior, considered);
  EXPECT_GT(without.report.rejected, 100);
  EXPECT_GT((without.posterior.x.p - s.truth.p).norm(), 0.05);
  EXPECT_LT(with.report.rejected, 0.3 * without.report.rejected);
  EXPECT_LT((with.posterior.x.p - s.truth.p).norm(), 0.005);
}

// A wall of half a metre by half a metre: planes for a few of its clusters only.
TEST(LidarPipeline, ASweepOfFewerThanThirtyRowsLeavesTheStateAlone) {
  Standing s;
  const lab::Rectangle& wall = s.room.surfaces()[1];
  lab::Rectangle patch = wall;
  patch.corner += 0.5 * wall.u + 0.3 * wall.v;
  patch.u *= 0.8 / wall.u.norm();
  patch.v *= 0.8 / wall.v.norm();
  const Estimate prior = s.prior({0.02, -0.015, 0.01}, 0.02);
  const Registration r = s.measured(test::exact_map({patch}, SE3()), prior);
  EXPECT_GT(r.report.matched, 0) << "it has some";
  EXPECT_LT(r.report.matched, 30);
  EXPECT_FALSE(r.refused);
  EXPECT_FALSE(r.carries);
  EXPECT_TRUE(r.by_epoch.empty());
  expect_untouched(r.posterior, prior);
}

TEST(LidarPipeline, ASweepOfOneWallSaysNothingOfTheWayAlongIt) {
  Standing s;
  const lab::Rectangle& wall = s.room.surfaces()[1];
  const Estimate prior = s.prior({0.02, -0.015, 0.01}, 0.02);
  const Registration r = s.measured(test::exact_map({wall}, SE3()), prior);
  EXPECT_GT(r.report.matched, 30);
  EXPECT_EQ(r.report.degeneracy.weak_count, 3);
  const Eigen::Vector3d moved = r.posterior.x.p - prior.x.p;
  EXPECT_LT(std::abs(moved.dot(wall.u.normalized())), 0.002);
  EXPECT_LT(std::abs(moved.dot(wall.v.normalized())), 0.002);
  EXPECT_LT(std::abs((r.posterior.x.p - s.truth.p).dot(wall.normal())), 0.003);
}

TEST(LidarPipeline, AnEmptyMapTakesTheSweepAsItIs) {
  Standing s;
  const Estimate prior = s.prior({0.02, 0, 0}, 0.02);
  const Registration r = s.measured(VoxelMap(MapConfig{}), prior);
  EXPECT_TRUE(r.carries);
  EXPECT_FALSE(r.refused);
  EXPECT_GT(r.clusters.size(), 100u);
  expect_untouched(r.posterior, prior);
}

TEST(LidarPipeline, SweepsThatFitNowhereForTwoSecondsBeginTheMapAnew) {
  LidarPipeline pipeline(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
  for (int tenth = 0; tenth < 20; ++tenth) EXPECT_FALSE(pipeline.refuse(early + tenth * milliseconds(100), false)) << tenth;
  EXPECT_TRUE(pipeline.is_rejoining());
  EXPECT_TRUE(pipeline.refuse(early + milliseconds(2000), false));
  EXPECT_FALSE(pipeline.is_rejoining()) << "there is nothing to rejoin";
  EXPECT_FALSE(pipeline.is_blind_somewhere());
  EXPECT_FALSE(pipeline.refuse(early + milliseconds(2100), false)) << "the two seconds begin again";
}

TEST(LidarPipeline, AnAcceptedSweepInBetweenOrAGivenMapLeavesItAsItIs) {
  LidarPipeline pipeline(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
  LidarPipeline given(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
  Registration fits;
  fits.carries = true;
  for (int tenth = 0; tenth < 100; ++tenth) {
    const Time t = early + tenth * milliseconds(100);
    EXPECT_FALSE(given.refuse(t, true)) << tenth;
    EXPECT_FALSE(pipeline.refuse(t, false)) << tenth;
    if (tenth % 15 == 14) pipeline.accept(fits);
  }
}

// 100 clusters, of which 90 met a known surface and so many were on it; the pose is `off` beside the prior.
Registration agreeing(const Estimate& prior, int matched, double off) {
  Registration out;
  out.posterior = prior;
  out.posterior.x.p.x() += off;
  out.carries = true;
  out.report.clusters = 100;
  out.report.matched = matched;
  out.report.rejected = 90 - matched;
  return out;
}

Estimate known_to_a_centimetre() {
  Estimate e;
  e.P.diagonal().setConstant(1e-4);
  return e;
}

TEST(LidarPipeline, AfterAnOutageTheMapGrowsOnceThreeSweepsInARowAgree) {
  LidarPipeline pipeline(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
  const Estimate prior = known_to_a_centimetre();
  EXPECT_TRUE(pipeline.may_learn(prior, agreeing(prior, 10, 1), no_error())) << "nothing is to be joined";
  pipeline.rejoin();
  const auto learns = [&](int matched, double off) { return pipeline.may_learn(prior, agreeing(prior, matched, off), no_error()); };
  EXPECT_FALSE(learns(80, 0.01));
  EXPECT_FALSE(learns(80, 0.01));
  EXPECT_FALSE(learns(80, 0.1)) << "ten sigmas beside the prediction: it begins again";
  EXPECT_FALSE(learns(80, 0.01));
  EXPECT_FALSE(learns(80, 0.01));
  EXPECT_FALSE(learns(50, 0.01)) << "half of it is beside the map: it begins again";
  EXPECT_FALSE(learns(80, 0.01));
  EXPECT_FALSE(learns(80, 0.01));
  EXPECT_TRUE(learns(80, 0.01));
  EXPECT_FALSE(pipeline.is_rejoining());
}

TEST(LidarPipeline, WhereTheMapIsNotTheSweepIsLearntButProvesNothing) {
  LidarPipeline pipeline(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
  const Estimate prior = known_to_a_centimetre();
  pipeline.rejoin();
  Registration elsewhere = agreeing(prior, 10, 0);
  elsewhere.report.rejected = 0;
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(pipeline.may_learn(prior, elsewhere, no_error()));
  EXPECT_TRUE(pipeline.is_rejoining());
}

TEST(LidarPipeline, TheErrorOfTheMapIsNoContradiction) {
  const Estimate prior = known_to_a_centimetre();
  PoseCovariance of_map = PoseCovariance::Zero();
  for (const double sigma : {0.0, 0.05}) {
    of_map.diagonal().setConstant(sigma * sigma);
    LidarPipeline pipeline(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
    pipeline.rejoin();
    for (int i = 0; i < 3; ++i) pipeline.may_learn(prior, agreeing(prior, 80, 0.1), of_map);
    EXPECT_EQ(pipeline.is_rejoining(), sigma == 0);
  }
}

TEST(LidarPipeline, AfterThreePeriodsOfSilenceTheMapIsJoinedAgain) {
  LidarPipeline pipeline(LidarMount{}, LidarConfig{}, UpdateConfig{}, 1);
  pipeline.note_silence(milliseconds(300));
  EXPECT_FALSE(pipeline.is_rejoining());
  pipeline.note_silence(milliseconds(301));
  EXPECT_TRUE(pipeline.is_rejoining());
}

// A sweep without a shape hides directions that the world shows: what it left open is searched for by the next ones. After two seconds it
// is taken for the world's.
TEST(LidarPipeline, WhatAFoundSweepDoesNotHoldIsSearchedForAgainForTwoSeconds) {
  Standing s;
  const VoxelMap whole = s.whole();
  const Eigen::Vector3d along = s.room.surfaces()[1].u.normalized();
  Estimate prior = s.prior(0.3 * along, 0.001);
  prior.P.block<3, 3>(at::p, at::p) += 0.25 * along * along.transpose();
  Registration open = s.measured(whole, prior);
  ASSERT_TRUE(open.searched);
  open.report.degeneracy = s.measured(test::exact_map({s.room.surfaces()[1]}, SE3()), s.prior({0, 0, 0}, 0.01)).report.degeneracy;
  ASSERT_EQ(open.report.degeneracy.weak_count, 3);
  for (int tenth = 0; tenth <= 20; ++tenth) {
    s.pipeline.accept(open);
    EXPECT_TRUE(s.pipeline.is_blind_somewhere());
    EXPECT_TRUE(s.measured(whole, prior).searched) << tenth;
    open.posterior.t += milliseconds(100);
  }
  s.pipeline.accept(open);
  EXPECT_FALSE(s.measured(whole, prior).searched);
}

// An error that is larger than what the nearest planes can show is theirs as much as the pose's.
TEST(LidarPipeline, APriorThatIsUncertainAlongAWeakDirectionIsTakenRelativeToTheMap) {
  Standing s;
  Registration sweep;
  sweep.carries = true;
  sweep.posterior = s.prior({0, 0, 0}, 0.01);
  sweep.report.information.A.diagonal() << 1e6, 1e6, 1e6, 1, 1e6, 1e6;
  sweep.report.degeneracy = find_degeneracy(sweep.report.information, 0.002, {});
  ASSERT_EQ(sweep.report.degeneracy.weak_count, 1);
  constexpr double reach = 0.1;
  Estimate prior = s.prior({0, 0, 0}, 0.01);
  prior.P(at::p, at::p) = 0.3 * 0.3;
  prior.P(at::p, at::v) = prior.P(at::v, at::p) = 0.5 * 0.3 * 1e-3;
  const Covariance before = prior.P;
  EXPECT_EQ(s.pipeline.release(prior, no_error(), reach), no_error()) << "no direction was weak";
  EXPECT_EQ(prior.P, before);
  s.pipeline.accept(sweep);
  const PoseCovariance released = s.pipeline.release(prior, no_error(), reach);
  EXPECT_NEAR(std::sqrt(prior.P(at::p, at::p)), reach, 1e-6);
  EXPECT_NEAR(released(3, 3), 0.3 * 0.3 - reach * reach, 1e-6) << "what is reported stays";
  EXPECT_EQ(prior.P(at::v, at::v), before(at::v, at::v));
  EXPECT_NEAR(prior.P(at::p, at::v), 0.5 * reach * 1e-3, 1e-9) << "as much of it as before comes from the velocity";
  EXPECT_NEAR(prior.P(at::p + 1, at::p + 1), before(at::p + 1, at::p + 1), 1e-12);
  PoseCovariance map_error = released;
  prior.P(at::p, at::p) = 0.15 * 0.15;
  map_error += s.pipeline.release(prior, map_error, reach);
  EXPECT_NEAR(std::sqrt(map_error(3, 3)), std::sqrt(released(3, 3)) + 0.05, 1e-6) << "standard deviations add";
  s.pipeline.accept({});
  prior.P(at::p, at::p) = 0.09;
  EXPECT_EQ(s.pipeline.release(prior, map_error, reach), no_error()) << "a sweep that knows nothing shows no planes";
}

}  // namespace lidar_pipeline_test
}  // namespace kilvo
