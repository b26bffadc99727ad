// The estimator as a whole, on a room whose truth is a formula.
#include "kilvo/estimator/estimator.hpp"

#include <Eigen/Cholesky>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "lab/simulation/analytic_room.hpp"

namespace kilvo {
namespace estimator_test {

constexpr std::array<bool, sensor_count> imu_and_lidar = {true, false, true, false};

lab::AnalyticRoomConfig small_room() {
  lab::AnalyticRoomConfig config;
  config.duration = 8;
  config.points_per_scan = 4000;
  return config;
}

struct Replay {
  std::vector<Output> outputs;
  Statistics statistics;
  double worst_position = 0;  // m, at sweeps
  double worst_rotation = 0;  // rad
};

// `edit` may change a measurement or, by returning false, keep it away.
Replay run(const lab::AnalyticRoomConfig& room_config, const std::function<bool(Measurement&)>& edit = {}, int threads = 1,
           std::array<bool, sensor_count> used = imu_and_lidar, const EstimatorConfig& start_from = {}) {
  lab::AnalyticRoom room(room_config);
  Robot robot;
  robot.lidar.T_imu_lidar = room_config.T_imu_lidar;
  EstimatorConfig config = start_from;
  config.threads = threads;
  Estimator estimator(robot, config, used);
  Replay out;
  const auto take = [&out](std::vector<Output> outputs) {
    for (Output& o : outputs) out.outputs.push_back(std::move(o));
  };
  while (auto m = room.next()) {
    if (!edit || edit(*m)) take(estimator.push(std::move(*m)));
  }
  take(estimator.finish());
  out.statistics = estimator.statistics();
  if (out.outputs.empty()) return out;
  // Relative to the first pose: the world is fixed by it.
  const SE3 T_WR = out.outputs.front().x.pose() * room.truth(out.outputs.front().t).inverse();
  for (const Output& o : out.outputs) {
    if (!o.is_sweep) continue;
    const SE3 truth = T_WR * room.truth(o.t);
    out.worst_position = std::max(out.worst_position, (truth.p - o.x.p).norm());
    out.worst_rotation = std::max(out.worst_rotation, (truth.R.inverse() * o.x.R).Log().norm());
  }
  return out;
}

void expect_sane(const Replay& r) {
  Time last{};
  for (const Output& o : r.outputs) {
    EXPECT_GE(o.t, last);
    last = o.t;
    ASSERT_TRUE(is_finite({o.t, o.x, o.P}));
    EXPECT_LE((o.P - o.P.transpose()).norm(), 1e-14 * o.P.norm());
    ASSERT_EQ(Eigen::LLT<Covariance>(o.P).info(), Eigen::Success);
  }
}

std::uint64_t dropped(const Replay& r, Sensor s, const std::string& cause) {
  const auto& causes = r.statistics.sensors[static_cast<std::size_t>(s)].dropped;
  const auto it = causes.find(cause);
  return it == causes.end() ? 0 : it->second;
}

bool same_states(const Replay& a, const Replay& b) {
  if (a.outputs.size() != b.outputs.size()) return false;
  for (std::size_t i = 0; i < a.outputs.size(); ++i) {
    const Output &x = a.outputs[i], &y = b.outputs[i];
    if (x.t != y.t || x.x.p != y.x.p || x.x.R.matrix() != y.x.R.matrix() || x.P != y.P || x.points_W != y.points_W) return false;
  }
  return true;
}

// Removes measurements of one sensor between two times after the start.
std::function<bool(Measurement&)> without(Sensor sensor, double from, double to) {
  return [=, first = std::optional<Time>()](Measurement& m) mutable {
    if (!first) first = stamp_of(m);
    const double s = to_seconds(stamp_of(m) - *first);
    return sensor_of(m) != sensor || s < from || s >= to;
  };
}

TEST(Estimator, BegunOnTheMoveTheSweepsHoldIt) {
  EstimatorConfig config;
  config.initial.still_gyro = 1e-9;  // it never stands still
  const Replay r = run(small_room(), {}, 1, imu_and_lidar, config);
  expect_sane(r);
  EXPECT_LT(r.worst_position, 0.15) << "the first of them has to find the velocity: without them it is metres";
  EXPECT_GE(r.statistics.sensors[index_of(Sensor::lidar)].used, 40u);
}

TEST(Estimator, FollowsARoomWithinMillimetresAtImuRate) {
  const Replay r = run(small_room());
  expect_sane(r);
  EXPECT_LT(r.worst_position, 0.004);
  EXPECT_LT(r.worst_rotation, 0.002);
  EXPECT_GE(r.outputs.size(), 8 * 200u);
  EXPECT_EQ(r.statistics.sensors[0].used, 1601u);
  EXPECT_GE(r.statistics.sensors[2].used, 79u);
  EXPECT_FALSE(r.statistics.diverged);
}

TEST(Estimator, GivesTheSameBytesAgainAndWithTwoThreads) {
  auto config = small_room();
  config.duration = 4;
  const Replay once = run(config);
  EXPECT_TRUE(same_states(once, run(config)));
  EXPECT_TRUE(same_states(once, run(config, {}, 2)));
}

TEST(Estimator, ANonFiniteImuSampleIsDroppedAndCountedAndChangesNothingElse) {
  auto config = small_room();
  config.duration = 4;
  const auto poison = [n = 0](Measurement& m) mutable {
    if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && ++n == 500) imu->gyro.y() = std::numeric_limits<double>::quiet_NaN();
    return true;
  };
  const auto remove = [n = 0](Measurement& m) mutable { return !std::holds_alternative<ImuSample>(m) || ++n != 500; };
  const Replay poisoned = run(config, poison);
  EXPECT_EQ(dropped(poisoned, Sensor::imu, "not finite"), 1u);
  EXPECT_TRUE(same_states(poisoned, run(config, remove)));
}

TEST(Estimator, AbsurdSamplesAndClocksAreDropped) {
  auto config = small_room();
  config.duration = 4;
  const auto edit = [n = 0](Measurement& m) mutable {
    if (auto* imu = std::get_if<ImuSample>(&m)) {
      ++n;
      if (n == 400) imu->accel.x() = 1e30;
      if (n == 500) imu->t += std::chrono::hours(1);
      if (n == 600) imu->t -= std::chrono::seconds(1);
    }
    return true;
  };
  const Replay r = run(config, edit);
  expect_sane(r);
  EXPECT_EQ(dropped(r, Sensor::imu, "absurd value"), 1u);
  EXPECT_EQ(dropped(r, Sensor::imu, "time jump"), 1u);
  EXPECT_EQ(dropped(r, Sensor::imu, "its clock went back"), 1u);
  EXPECT_LT(r.worst_position, 0.01);
}

TEST(Estimator, AGapOfHalfASecondInTheImuIsBridged) {
  const Replay r = run(small_room(), without(Sensor::imu, 4.0, 4.5));
  expect_sane(r);
  EXPECT_EQ(r.statistics.rollbacks, 0u);
  double last_error = 0;
  lab::AnalyticRoom room(small_room());
  const SE3 T_WR = r.outputs.front().x.pose() * room.truth(r.outputs.front().t).inverse();
  last_error = ((T_WR * room.truth(r.outputs.back().t)).p - r.outputs.back().x.p).norm();
  EXPECT_LT(last_error, 0.05);
}

TEST(Estimator, StandingWithALargeGyroBiasItStaysWhereItIs) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1);
  Estimator estimator(Robot{}, {}, {true, false, false, false});
  double worst = 0, sigma = 0;  // in standard deviations; m
  for (int i = 0; i < 30 * 200; ++i) {
    ImuSample s;
    s.t = Time(std::chrono::milliseconds(5 * i));
    s.gyro = Eigen::Vector3d(0.03, -0.04, 0) + 1e-3 * Eigen::Vector3d(noise(random), noise(random), noise(random));
    s.accel = Eigen::Vector3d(0, 0, 9.81) + 0.02 * Eigen::Vector3d(noise(random), noise(random), noise(random));
    for (const Output& o : estimator.push(s)) {
      EXPECT_EQ(o.modality, Modality::coast);
      const Eigen::Vector3d of_axes = o.P.diagonal().segment<3>(at::p).cwiseSqrt();
      worst = std::max(worst, o.x.p.cwiseAbs().cwiseQuotient(of_axes).maxCoeff());
      sigma = of_axes.maxCoeff();
    }
  }
  EXPECT_TRUE(estimator.initialised());
  EXPECT_LT(worst, 3);
  EXPECT_LT(sigma, 0.1) << "it is known to stand";
}

TEST(Estimator, WithoutScansItCoastsAndTheCovarianceGrows) {
  const Replay r = run(small_room(), {}, 1, {true, false, false, false});
  expect_sane(r);
  ASSERT_FALSE(r.outputs.empty());
  EXPECT_EQ(r.outputs.back().modality, Modality::coast);
  EXPECT_GT(r.outputs.back().P(at::p, at::p), 100 * r.outputs[200].P(at::p, at::p));
  EXPECT_EQ(dropped(r, Sensor::lidar, "not used"), 79u) << "every scan that the room delivers";
}

TEST(Estimator, ScansWithoutAUsablePointDoNoHarm) {
  auto config = small_room();
  config.duration = 4;
  const auto edit = [n = 0](Measurement& m) mutable {
    if (auto* scan = std::get_if<LidarScan>(&m)) {
      ++n;
      if (n == 20) scan->points.clear();
      if (n == 22) scan->points.resize(1);
      if (n == 24) {
        for (LidarPoint& p : scan->points) p.x = std::numeric_limits<float>::infinity();
      }
    }
    return true;
  };
  const Replay r = run(config, edit);
  expect_sane(r);
  EXPECT_EQ(dropped(r, Sensor::lidar, "empty"), 1u);
  EXPECT_EQ(r.statistics.points.non_finite, 4000u);
  EXPECT_LT(r.worst_position, 0.01);
}

TEST(Estimator, AnAccelerometerInGGivesTheSamePath) {
  auto config = small_room();
  config.duration = 4;
  const auto in_g = [](Measurement& m) {
    if (auto* imu = std::get_if<ImuSample>(&m)) imu->accel /= standard_gravity;
    return true;
  };
  const Replay r = run(config, in_g);
  EXPECT_LT(r.worst_position, 0.004);
  ASSERT_FALSE(r.outputs.empty());
  EXPECT_NEAR(r.outputs.back().x.g.norm(), standard_gravity, 1e-9);
}

TEST(Estimator, WithoutAnImuItSaysWhatIsMissing) {
  EXPECT_THROW(Estimator(Robot{}, EstimatorConfig{}, {false, false, true, false}), std::invalid_argument);
}

TEST(Estimator, SaysWhatItWaitsForUntilItHasStarted) {
  Estimator estimator(Robot{}, EstimatorConfig{}, imu_and_lidar);
  EXPECT_FALSE(estimator.initialised());
  EXPECT_NE(estimator.waiting_for(), "");
}

}  // namespace estimator_test
}  // namespace kilvo
