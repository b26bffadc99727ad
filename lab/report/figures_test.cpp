#include "lab/report/figures.hpp"

#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

namespace kilvo::lab {
namespace figures_test {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Time start = time_from_ns(1700000000000000000);
const TimeBase time_base{start};

Time at(double seconds) { return start + from_seconds(seconds); }

SE3 pose(double x, double y, double yaw) { return {SO3::Exp({0, 0, yaw}), {x, y, 0}}; }

/// A way along x at 1 m/s, a sweep each 0.1 s, and its truth: the same in a world turned by 90 degrees and moved.
struct Walk {
  RunFiles run;
  std::vector<StampedPose> truth;
  SE3 T_GE = pose(10, 20, std::numbers::pi / 2);

  explicit Walk(int sweeps = 51) {
    for (int i = 0; i < sweeps; ++i) {
      const SE3 T = pose(0.1 * i, 0.05 * std::sin(i), 0);
      run.sweeps.push_back({at(0.1 * i), T});
      truth.push_back({at(0.1 * i), T_GE * T});
    }
    run.odometry = run.sweeps;
  }
};

TEST(Figures, TheTruthIsDrawnInTheWorldOfTheEstimate) {
  const Walk walk;
  const Curves curves = curves_of(time_base, way_of(walk.run, walk.truth));
  ASSERT_THAT(curves.truth, SizeIs(51));
  EXPECT_NEAR(curves.truth[50].t, 5, 1e-9);
  EXPECT_LT((curves.truth[50].p - curves.estimate[50].p).norm(), 1e-6);
  EXPECT_LT((curves.truth[50].p - walk.run.sweeps[50].T.p).norm(), 1e-6);
}

TEST(Figures, AnErrorIsShownWithThreeSigma) {
  Walk walk;
  for (StampedPose& sweep : walk.run.sweeps)
    if (sweep.t >= at(2)) sweep.T = sweep.T * pose(0, 0.004, 0.001);  // 4 mm to the left, 1 mrad
  StateRow row;
  row.sigma_p = {0.001, 0.002, 0.003};
  row.sigma_R = {1e-3, 1e-3, 2e-3};
  std::vector<StateRow> states(51, row);
  for (std::size_t i = 0; i < states.size(); ++i) states[i].t = at(0.1 * static_cast<double>(i));
  const Figures figures = error_figures(time_base, way_of(walk.run, walk.truth), states);
  ASSERT_THAT(figures, SizeIs(3));
  const Json& y = figures[1]["panels"][1];
  EXPECT_EQ(y["unit"], "mm");
  EXPECT_THAT(y["lines"][0]["y"].front().get<double>(), DoubleNear(0, 1e-3));
  EXPECT_THAT(y["lines"][0]["y"].back().get<double>(), DoubleNear(4, 1e-3));
  EXPECT_THAT(y["bands"][0]["y"].back().get<double>(), DoubleNear(6, 1e-3));
  const Json& yaw = figures[2]["panels"][2];
  EXPECT_THAT(yaw["lines"][0]["y"].back().get<double>(), DoubleNear(0.0573, 1e-4));
  EXPECT_THAT(yaw["bands"][0]["y"].back().get<double>(), DoubleNear(0.3438, 1e-4));
  EXPECT_THAT(error_figures(time_base, way_of(walk.run, walk.truth), {})[1]["panels"][0]["bands"], IsEmpty());
}

TEST(Figures, WhereSweepsEndTheOdometryIsShown) {
  Walk walk(11);
  for (int i = 1000; i < 10000; ++i) walk.run.odometry.push_back({at(0.001 * i), pose(0.001 * i, 0, 0)});
  const Way way = way_of(walk.run);
  EXPECT_FALSE(way.of_sweeps);
  EXPECT_NEAR(static_cast<double>(way.poses.size()), 10 + 9 * 20, 3);
  EXPECT_TRUE(way_of(Walk().run).of_sweeps);
}

TEST(Figures, AHoleInTheSweepsIsFilledByTheOdometry) {
  Walk walk;
  for (int i = 0; i < 5000; ++i) walk.run.odometry.push_back({at(0.001 * i), pose(0.001 * i, 0, 0)});
  walk.run.odometry.erase(walk.run.odometry.begin(), walk.run.odometry.begin() + 51);
  EXPECT_EQ(way_of(walk.run).poses.size(), 51);
  EXPECT_TRUE(way_of(walk.run).of_sweeps);
  std::erase_if(walk.run.sweeps, [](const StampedPose& s) { return s.t > at(2.05) && s.t < at(3.95); });  // 2.0 to 4.0 s
  const Way way = way_of(walk.run);
  EXPECT_FALSE(way.of_sweeps);
  EXPECT_NEAR(static_cast<double>(way.poses.size()), 51 - 19 + 39, 1);
  for (std::size_t i = 1; i < way.poses.size(); ++i) {
    EXPECT_GT(way.poses[i].t, way.poses[i - 1].t);
    EXPECT_LE(to_seconds(way.poses[i].t - way.poses[i - 1].t), 0.1 + 1e-9);
  }
}

TEST(Figures, VelocityStandsBesideThatOfTheTruth) {
  const Walk walk;
  std::vector<StampedPose> truth;
  for (int i = 0; i <= 5000; ++i) truth.push_back({at(0.001 * i), walk.T_GE * pose(0.001 * i, 0, 0)});
  std::vector<StateRow> states;
  for (int i = 0; i <= 50; ++i) states.push_back({at(0.1 * i), {1, 0, 0}, {0.01, 0, 0}, {0, 0.02, 0}, {0, 0, 0}, {0, 0, 0}});
  const Walk straight = [&] {
    Walk w;
    for (int i = 0; i < 51; ++i) w.run.sweeps[static_cast<std::size_t>(i)].T = pose(0.1 * i, 0, 0);
    return w;
  }();
  const Figures figures = state_figures(time_base, states, truth, way_of(straight.run, truth));
  ASSERT_THAT(figures, SizeIs(2));
  const Json& x = figures[0]["panels"][0]["lines"];
  EXPECT_EQ(x[0]["name"], "true x");
  for (const Json& v : x[0]["y"]) EXPECT_NEAR(v.get<double>(), 1, 1e-3);
  EXPECT_NEAR(figures[1]["panels"][0]["lines"][0]["y"][0].get<double>(), 0.573, 1e-3);  // deg/s
  EXPECT_NEAR(figures[1]["panels"][1]["lines"][1]["y"][0].get<double>(), 20, 1e-3);     // mm/s^2
}

TEST(Figures, AGapInTheOutputsStandsOut) {
  Walk walk;
  walk.run.odometry.clear();
  for (int i = 0; i < 4000; ++i)
    if (i < 2000 || i >= 2300) walk.run.odometry.push_back({at(0.001 * i), {}});
  const Figures figures = rate_figures(time_base, walk.run);
  ASSERT_THAT(figures, SizeIs(2));
  EXPECT_EQ(figures[0]["id"], "rates");
  const Json& odometry = figures[0]["rows"][0];
  EXPECT_EQ(odometry[1], 3700);
  EXPECT_NEAR(odometry[3].get<double>(), 301, 1e-6);  // ms
  EXPECT_NEAR(odometry[4].get<double>(), 2, 0.01);    // s
  EXPECT_EQ(odometry[5], 1);
}

TEST(Figures, EachStageIsCountedOnce) {
  std::vector<StageRow> timing;
  for (int i = 0; i < 1000; ++i) {
    timing.push_back({at(0.1 * i), "lidar", 500.0 + i});
    timing.push_back({at(0.1 * i), "map", i == 0 ? 0.0 : 50.0});
  }
  const Figures figures = stage_figures(time_base, timing);
  ASSERT_THAT(figures, SizeIs(3));
  for (const Json& group : figures[1]["groups"]) {
    double percent = 0;
    for (const Json& share : group["counts"]) percent += share.get<double>();
    EXPECT_NEAR(percent, 100, 0.1) << group["name"];
  }
  EXPECT_EQ(figures[2]["rows"][0], Json({"lidar", 999.0, 1489.0, 1499.0, 1000}));
}

TEST(Figures, WhereLegsAreLostNoFootStands) {
  std::vector<ContactRow> contacts;  // left is down but from 2 to 3 s; nothing is known from 4 to 6 s
  for (int i = 0; i < 800; ++i)
    if (i < 400 || i >= 600) contacts.push_back({{at(0.01 * i), {i < 200 || i >= 300, true}}, {0.01, NAN}});
  const Figures figures = contact_figures(time_base, contacts, {}, {});
  ASSERT_THAT(figures, SizeIs(2));  // strip and clearance
  const Json& left = figures[0]["rows"][0]["spans"];
  ASSERT_THAT(left, SizeIs(3));
  EXPECT_THAT(left[0], ElementsAre(0.0, 1.995, "left", "in contact"));
  EXPECT_THAT(left[1], ElementsAre(2.995, 3.99, "left", "in contact"));
  EXPECT_THAT(left[2], ElementsAre(6.0, 7.99, "left", "in contact"));
  EXPECT_THAT(figures[0]["rows"][1]["spans"], SizeIs(2));
  const Json& clearance = figures[1]["panels"][0]["lines"];
  EXPECT_TRUE(clearance[1]["y"][0].is_null());  // never known
  EXPECT_EQ(std::count(clearance[0]["y"].begin(), clearance[0]["y"].end(), Json(nullptr)), 1);
}

TEST(Figures, APointIsWhereItWasTo16Bits) {
  Cloud cloud;
  cloud.points_W = {{-1, -2, -3}, {1, 2, 3}, {0, 0, 0}};
  cloud.rgb = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  RunFiles run;
  run.map = cloud;
  const Figures figures = map_figures(time_base, run, {});
  ASSERT_THAT(figures, SizeIs(1));
  EXPECT_EQ(figures[0]["n"], 3);
  EXPECT_EQ(figures[0]["low"], Json({-1.0, -2.0, -3.0}));
  EXPECT_EQ(figures[0]["xyz"], "AAAAAAAA////////AIAAgACA");  // 0, 65535, 32768 each three times, little end first
  EXPECT_EQ(figures[0]["rgb"], "AQIDBAUGBwgJ");
  EXPECT_FALSE(figures[0].contains("intensity"));
}

TEST(Figures, WithoutDataThereAreNone) {
  const RunFiles nothing;
  const Way way = way_of(nothing);
  EXPECT_THAT(path_figures(time_base, way), IsEmpty());
  EXPECT_THAT(error_figures(time_base, way, {}), IsEmpty());
  EXPECT_THAT(state_figures(time_base, {}, {}, way), IsEmpty());
  EXPECT_THAT(contact_figures(time_base, {}, {}, {}), IsEmpty());
  EXPECT_THAT(modality_figures(time_base, nothing), IsEmpty());
  EXPECT_THAT(rate_figures(time_base, nothing), IsEmpty());
  EXPECT_THAT(stage_figures(time_base, {}), IsEmpty());
  EXPECT_THAT(map_figures(time_base, RunFiles{}, way), IsEmpty());
  EXPECT_THAT(summary_figures(Json::object()), IsEmpty());
}

TEST(Playback, PutsTheLegsWhereTheRobotIs) {
  RunFiles run;
  const Time begin = time_base.zero;
  for (int i = 0; i < 3; ++i) {
    const Time t = begin + std::chrono::seconds(i);
    run.odometry.push_back({t, {SO3::Exp({0, 0, 0.5 * M_PI * i}), {1.0 * i, 0, 0}}});
    const std::vector<Eigen::Vector3d> leg{{0, 0, 0}, {1, 0, -1}};
    run.skeleton.push_back({t, {leg, leg}});
    run.contacts.push_back({{t, {i != 1, true}}, {}});
  }
  const Json robot = playback_of(time_base, run);
  EXPECT_EQ(robot["joints"], 2);
  EXPECT_EQ(robot["t"], Json({0.0, 1.0, 2.0}));
  EXPECT_EQ(robot["p"][1], Json({100, 0, 0, 100, 100, -100, 100, 0, 0, 100, 100, -100}));  // a quarter turn about z, 1 m along x
  EXPECT_EQ(robot["on"], Json({3, 2, 3}));
  EXPECT_TRUE(playback_of(time_base, RunFiles{}).is_null());
}

}  // namespace figures_test
}  // namespace kilvo::lab
