// Starts on the move without legs, in a room whose truth is a formula.
#include "kilvo/estimator/moving_start.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <vector>

#include "kilvo/estimator/estimator.hpp"
#include "lab/simulation/analytic_room.hpp"

namespace kilvo {
namespace moving_start_test {

struct Walk {
  std::vector<Output> outputs;
  Statistics statistics;
  double worst = 0, speed = 0;  // m, of sweeps, after the first pose of one; m/s, of the truth there
  double velocity_error = 0;    // m/s, there
};

// What comes from `from` seconds on. `edit`: changes a scan.
template <class Edit>
Walk walk_from(double from, std::uint64_t seed, Edit&& edit) {
  lab::AnalyticRoomConfig config;
  config.seed = seed;
  config.still = 0;
  config.duration = from + 9;
  lab::AnalyticRoom room(config);
  Robot robot;
  robot.lidar.T_imu_lidar = config.T_imu_lidar;
  Estimator estimator(robot, EstimatorConfig{}, {true, false, true, false});
  Walk out;
  while (auto m = room.next()) {
    if (stamp_of(*m) < room.start() + from_seconds(from)) continue;
    if (auto* scan = std::get_if<LidarScan>(&*m)) edit(*scan);
    estimator.push(std::move(*m), out.outputs);
  }
  estimator.finish(out.outputs);
  out.statistics = estimator.statistics();
  std::optional<SE3> T_WR;
  for (const Output& o : out.outputs) {
    if (!o.is_sweep) continue;
    if (!T_WR) {
      T_WR = o.x.pose() * room.truth(o.t).inverse();
      out.speed = room.velocity(o.t).norm();
      out.velocity_error = (o.x.v - T_WR->R * room.velocity(o.t)).norm();
    }
    out.worst = std::max(out.worst, (o.x.p - (*T_WR * room.truth(o.t)).p).norm());
  }
  return out;
}

TEST(MovingStart, TheFirstSweepThatIsUsedHasItsShape) {
  for (const double from : {3.0, 6.5, 8.0}) {
    const Walk walk = walk_from(from, 1, [](LidarScan&) {});
    ASSERT_FALSE(walk.outputs.empty());
    EXPECT_GT(walk.speed, 0.3) << from;
    EXPECT_LT(walk.velocity_error, 0.12) << from;
    EXPECT_LT(walk.worst, 0.012) << from;
    EXPECT_FALSE(walk.statistics.diverged);
    EXPECT_EQ(walk.statistics.maps_begun_anew, 0U);
    const auto& lidar = walk.statistics.sensors[index_of(Sensor::lidar)];
    EXPECT_GE(lidar.used, 50U) << from;
    EXPECT_GE(lidar.dropped.at(text_of(Reason::before_motion)), 1U) << "sweeps whose parts tell the velocity";
  }
}

TEST(MovingStart, ScansWhosePointsHaveNoTimesStillBegin) {
  const Walk walk = walk_from(3, 2, [](LidarScan& scan) {
    for (LidarPoint& p : scan.points) p.offset_ns = 0;
  });
  EXPECT_GE(walk.statistics.sensors[index_of(Sensor::lidar)].used, 20U);
  for (const Output& o : walk.outputs) ASSERT_TRUE(is_finite({o.t, o.x, o.P}));
}

TEST(MovingStart, WithoutAUsablePointItIsGivenUpAfterTwoSeconds) {
  int sweeps = 0;
  const Walk walk = walk_from(3, 3, [&sweeps](LidarScan& scan) {
    if (++sweeps > 50) return;
    for (LidarPoint& p : scan.points) p.x = p.y = p.z = 0;
  });
  EXPECT_GE(walk.statistics.sensors[index_of(Sensor::lidar)].used, 10U) << "of the sweeps that came then";
  for (const Output& o : walk.outputs) ASSERT_TRUE(is_finite({o.t, o.x, o.P}));
}

}  // namespace moving_start_test
}  // namespace kilvo
