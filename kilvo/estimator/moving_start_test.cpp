// Starts on the move without legs, in a room whose truth is a formula.
#include "kilvo/estimator/moving_start.hpp"

#include <algorithm>
#include <cmath>
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
  double velocity_in_sigmas = 0;
  double worst_of_all = 0;     // m, of any output after the first one
  double worst_in_sigmas = 0;  // the same, of the position's sigma
  int without_lidar = 0;       // outputs whose modality has no LiDAR, before the last second
};

// What comes from `from` seconds on. `edit`: changes a measurement or, by returning false, keeps it away; with the time since the start, s.
template <class Edit>
Walk walk_from(double from, std::uint64_t seed, Edit&& edit) {
  lab::AnalyticRoomConfig config;
  config.seed = seed;
  config.still = 0;
  config.duration = from + 12;
  lab::AnalyticRoom room(config);
  Robot robot;
  robot.lidar.T_imu_lidar = config.T_imu_lidar;
  Estimator estimator(robot, EstimatorConfig{}, {true, false, true, false});
  const Time begin = room.start() + from_seconds(from);
  Walk out;
  while (auto m = room.next()) {
    const double s = to_seconds(stamp_of(*m) - begin) - EstimatorConfig{}.initial.moving_start;
    if (stamp_of(*m) >= begin && edit(*m, s)) estimator.push(std::move(*m), out.outputs);
  }
  estimator.finish(out.outputs);
  out.statistics = estimator.statistics();
  std::optional<SE3> T_WR, T_WR_sweep;
  for (const Output& o : out.outputs) {
    const SE3 truth = room.truth(o.t);
    if (!T_WR) T_WR = o.x.pose() * truth.inverse();
    const double off = (o.x.p - (*T_WR * truth).p).norm();
    out.worst_of_all = std::max(out.worst_of_all, off);
    out.worst_in_sigmas = std::max(out.worst_in_sigmas, off / std::sqrt(o.P.diagonal().segment<3>(at::p).sum() + 1e-6));
    out.without_lidar += !has_lidar(o.modality) && o.t < out.outputs.back().t - std::chrono::seconds(1) ? 1 : 0;
    if (!o.is_sweep) continue;
    if (!T_WR_sweep) {
      T_WR_sweep = o.x.pose() * truth.inverse();
      out.speed = room.velocity(o.t).norm();
      out.velocity_error = (o.x.v - T_WR_sweep->R * room.velocity(o.t)).norm();
      out.velocity_in_sigmas = out.velocity_error / std::sqrt(o.P.diagonal().segment<3>(at::v).sum());
    }
    out.worst = std::max(out.worst, (o.x.p - (*T_WR_sweep * truth).p).norm());
  }
  for (const Output& o : out.outputs) EXPECT_TRUE(is_finite({o.t, o.x, o.P}));
  return out;
}

const auto everything = [](Measurement&, double) { return true; };

TEST(MovingStart, TheFirstSweepThatIsUsedHasItsShape) {
  for (const double from : {3.0, 6.5, 8.0}) {
    const Walk walk = walk_from(from, 1, everything);
    EXPECT_GT(walk.speed, 0.3) << from;
    EXPECT_LT(walk.velocity_in_sigmas, 4) << from << ": " << walk.velocity_error << " m/s";
    EXPECT_LT(walk.worst, 0.012) << from;
    EXPECT_LT(walk.worst_in_sigmas, 4) << from << ": " << walk.worst_of_all << " m";
    EXPECT_EQ(walk.without_lidar, 0) << from << ": the parts of sweeps carry the estimate";
    EXPECT_FALSE(walk.statistics.diverged);
    EXPECT_EQ(walk.statistics.maps_begun_anew, 0U);
    const auto& lidar = walk.statistics.sensors[index_of(Sensor::lidar)];
    EXPECT_GE(lidar.used, 75U) << from;
    EXPECT_GE(lidar.dropped.at(text_of(Reason::before_motion)), 2U) << "sweeps whose parts tell the velocity";
  }
}

TEST(MovingStart, ScansWhosePointsHaveNoTimesStillBegin) {
  const Walk walk = walk_from(3, 2, [](Measurement& m, double) {
    if (auto* scan = std::get_if<LidarScan>(&m)) {
      for (LidarPoint& p : scan->points) p.offset_ns = 0;
    }
    return true;
  });
  EXPECT_GE(walk.statistics.sensors[index_of(Sensor::lidar)].used, 40U);
}

TEST(MovingStart, WithoutAUsablePointItIsGivenUpAfterTwoSeconds) {
  const Walk walk = walk_from(3, 3, [](Measurement& m, double s) {
    if (auto* scan = std::get_if<LidarScan>(&m); scan != nullptr && s < 4) {
      for (LidarPoint& p : scan->points) p.x = p.y = p.z = 0;
    }
    return true;
  });
  const auto& lidar = walk.statistics.sensors[index_of(Sensor::lidar)];
  EXPECT_LE(lidar.dropped.at(text_of(Reason::before_motion)), 22U);
  EXPECT_GE(lidar.dropped.at(text_of(Reason::no_usable_point)), 15U);
  EXPECT_GE(lidar.used, 10U) << "of the sweeps that came then";
}

TEST(MovingStart, AGapOfTheImuMeanwhileIsOvercome) {
  const Walk walk = walk_from(3, 4, [](Measurement& m, double s) { return !std::holds_alternative<ImuSample>(m) || s < 0.25 || s > 0.55; });
  EXPECT_FALSE(walk.statistics.diverged);
  EXPECT_GE(walk.statistics.sensors[index_of(Sensor::lidar)].used, 60U);
  EXPECT_LT(walk.worst, 0.03);
  EXPECT_LT(walk.worst_in_sigmas, 4) << walk.worst_of_all << " m";
}

TEST(MovingStart, SweepsThatComeLateBeginAsWell) {
  const Walk walk = walk_from(3, 5, [](Measurement& m, double s) { return !std::holds_alternative<LidarScan>(m) || s > 2.6; });
  EXPECT_FALSE(walk.statistics.diverged);
  EXPECT_LT(walk.worst, 0.03);
  EXPECT_LT(walk.worst_in_sigmas, 4) << walk.worst_of_all << " m";
}

}  // namespace moving_start_test
}  // namespace kilvo
