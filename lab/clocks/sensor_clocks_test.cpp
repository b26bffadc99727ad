#include "lab/clocks/sensor_clocks.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "tests/helpers/arrivals.hpp"

namespace kilvo::lab {
namespace sensor_clocks_test {

using namespace test_arrivals;

TEST(SensorClocks, OfOneClockNothingIsMovedAndNothingWaits) {
  for (const Duration all : {Duration(0), to_uptime}) {
    Robot robot;
    robot.clock.fill(all);
    const Result result = result_of(robot);
    for (std::size_t i = 0; i < sensor_count; ++i) {
      EXPECT_EQ(result.worst[i], 0);
      EXPECT_EQ(result.least[i], 0);
      EXPECT_LE(result.withheld[i], 1);
    }
  }
}

TEST(SensorClocks, AnotherEpochIsMovedByOneConstantToTheDifferenceOfTheDelays) {
  for (const Duration ahead : {-to_uptime, to_uptime, Duration(seconds(3)), Duration(-seconds(20))}) {
    Robot robot;
    robot.clock = {Duration(0), ahead, ahead, ahead};
    const Result result = result_of(robot);
    for (std::size_t i = 1; i < sensor_count; ++i) {
      EXPECT_GT(result.given[i], 10);
      EXPECT_NEAR(result.worst[i], 0.001, 1e-6) << "the legs have the shortest way, and tell for all";
      EXPECT_EQ(result.worst[i], result.least[i]) << "no jitter";
    }
  }
}

TEST(SensorClocks, OfSeveralOtherClocksEachIsMovedByItself) {
  Robot robot;
  robot.clock = {Duration(0), -to_uptime, to_uptime, to_uptime + seconds(7)};
  const Result result = result_of(robot);
  const std::array<double, sensor_count> delay_beyond{0, 0.001, 0.011, 0.039};
  for (std::size_t i = 1; i < sensor_count; ++i) {
    EXPECT_NEAR(result.worst[i], delay_beyond[i], 1e-6) << i;
    EXPECT_EQ(result.worst[i], result.least[i]) << "no jitter";
  }
}

TEST(SensorClocks, ADelayOfSecondsAndAClockThatIsSlightlyAheadAreLeftAlone) {
  for (const Duration by : {Duration(-seconds(3)), Duration(milliseconds(1800))}) {
    Robot robot;
    robot.clock[index_of(Sensor::legs)] = by;
    EXPECT_NEAR(result_of(robot).worst[index_of(Sensor::legs)], to_seconds(by), 1e-9);
  }
}

TEST(SensorClocks, TheImuMayComeLaterThanTheOthersAndItsFirstMessagesLate) {
  for (const bool another : {false, true}) {
    Robot robot;
    robot.begin[0] = milliseconds(700);
    if (another) robot.clock[index_of(Sensor::legs)] = -to_uptime;
    auto arrivals = robot.arrivals();
    // What had waited for the recorder: six hundred samples of the IMU come at once, the first of them three seconds late.
    const Time opened = day + robot.begin[0] + milliseconds(1);
    std::vector<Robot::Arrival> waited;
    for (Duration before = seconds(3); before > Duration(0); before -= milliseconds(5))
      waited.push_back({ImuSample{opened - before}, opened, opened - before});
    const auto first = std::ranges::find_if(arrivals, [](const auto& a) { return std::holds_alternative<ImuSample>(a.m); });
    arrivals.insert(first, waited.begin(), waited.end());
    SensorClocks clocks;
    const Result result = result_of(clocks, arrivals, Duration(0));
    EXPECT_EQ(clocks.offset(Sensor::legs).has_value(), another);
    EXPECT_FALSE(clocks.offset(Sensor::lidar));
    EXPECT_NEAR(result.worst[1], another ? 0.001 : 0, 1e-6);
  }
}

TEST(SensorClocks, OneWrongStampIsOutvoted) {
  Robot robot;
  auto arrivals = robot.arrivals();
  std::array<bool, 2> is_first{true, true};
  for (auto& a : arrivals) {
    if (auto* imu = std::get_if<ImuSample>(&a.m); imu != nullptr && std::exchange(is_first[0], false)) imu->t += std::chrono::hours(1);
    if (auto* scan = std::get_if<LidarScan>(&a.m); scan != nullptr && std::exchange(is_first[1], false)) scan->t -= std::chrono::hours(1);
  }
  SensorClocks clocks;
  result_of(clocks, arrivals, Duration(0));
  for (const Sensor s : all_sensors) EXPECT_FALSE(clocks.offset(s)) << name_of(s);
}

TEST(SensorClocks, TimesOfArrivalThatTellNothingChangeNothing) {
  Robot robot;
  robot.clock[1] = -to_uptime;
  for (const bool equal : {true, false}) {
    auto arrivals = robot.arrivals();
    for (auto& a : arrivals) a.at = equal ? day : stamp_of(a.m);  // no clock at all; a tool that writes the stamps there
    SensorClocks clocks;
    result_of(clocks, arrivals, Duration(0));
    EXPECT_FALSE(clocks.offset(Sensor::legs));
  }
}

TEST(SensorClocks, ASensorThatComesLateIsJudgedByTheImuOfThen) {
  for (const Duration clock : {Duration(0), -to_uptime}) {
    Robot robot;
    robot.length = seconds(40);
    robot.begin[index_of(Sensor::camera)] = seconds(35);
    robot.clock[index_of(Sensor::camera)] = clock;
    auto arrivals = robot.arrivals();
    for (auto& a : arrivals) a.at += (a.at - day);  // played at half the speed, and recorded again
    SensorClocks clocks;
    result_of(clocks, arrivals, Duration(0));
    EXPECT_EQ(clocks.offset(Sensor::camera).has_value(), clock != Duration(0));
    EXPECT_FALSE(clocks.offset(Sensor::legs));
    EXPECT_FALSE(clocks.offset(Sensor::lidar));
  }
}

TEST(SensorClocks, ASmallSettingIsAddedAndALargeOneIsOfOtherClocks) {
  Robot robot;
  robot.clock[1] = -to_uptime;
  for (const double set : {0.0, 0.004, 12345.0}) {
    auto arrivals = robot.arrivals();
    for (auto& a : arrivals) {
      if (auto* joints = std::get_if<JointSample>(&a.m)) joints->t += from_seconds(set);
    }
    SensorClocks clocks({0, set, 0, 0});
    const Result result = result_of(clocks, arrivals, Duration(0));
    EXPECT_NEAR(result.worst[1], set < 1 ? 0.001 + set : 0.001, 2e-6);
    EXPECT_THAT(clocks.finding(Sensor::legs),
                ::testing::HasSubstr("legs: its stamps are of another clock than the IMU's: by the times of"));
    EXPECT_THAT(clocks.finding(Sensor::legs), ::testing::HasSubstr("legs.time_offset: -1699998999.99"));
    EXPECT_EQ(clocks.finding(Sensor::camera), "");
  }
  SensorClocks mended({0, to_seconds(to_uptime), 0, 0});
  auto arrivals = robot.arrivals();
  for (auto& a : arrivals) {
    if (auto* joints = std::get_if<JointSample>(&a.m)) joints->t += to_uptime;
  }
  result_of(mended, arrivals, Duration(0));
  EXPECT_FALSE(mended.offset(Sensor::legs));
}

/// The robot's messages, with each sensor's clock fast by so many parts in a million.
std::vector<Robot::Arrival> drifting(const Robot& robot, const std::array<double, sensor_count>& ppm) {
  auto out = robot.arrivals();
  for (auto& a : out) {
    std::visit([&](auto& x) { x.t += from_seconds(1e-6 * ppm[a.m.index()] * to_seconds(a.measured - day)); }, a.m);
  }
  return out;
}

TEST(SensorClocks, ThatDriftAreFollowed) {
  Robot robot;
  robot.length = seconds(600);
  for (const double imu : {0.0, 30.0}) {
    SensorClocks clocks;
    const std::array<double, sensor_count> ppm{imu, 50, imu, -20};
    double worst = 0, worst_lidar = 0;
    for (const auto& a : drifting(robot, ppm)) {
      Measurement m = a.m;
      clocks.note(m, a.at);
      clocks.correct(m, a.at);
      const double true_stamp = to_seconds(a.measured - day) * (1 + 1e-6 * imu);
      const double error = std::abs(to_seconds(stamp_of(m) - day) - true_stamp);
      if (m.index() == 1) worst = std::max(worst, error);
      if (m.index() == 2) worst_lidar = std::max(worst_lidar, error);
    }
    EXPECT_LT(worst, 8e-3) << "30 ms (12 against the IMU that drifts) without";
    EXPECT_LT(worst_lidar, 1e-6) << "one clock with the IMU's";
    EXPECT_THAT(clocks.drift_finding(Sensor::legs),
                testing::HasSubstr(imu > 0 ? "is 20 parts in a million faster" : "is 50 parts in a million faster"));
    EXPECT_THAT(clocks.drift_finding(Sensor::camera), testing::HasSubstr("slower"));
    EXPECT_EQ(clocks.drift_finding(Sensor::lidar), "");
  }
}

TEST(SensorClocks, ThatDriftAreFollowedThroughAPauseAndAStepOfTheDelay) {
  ClockDrift drift;
  double t = 0;
  const auto go = [&](double until, double later) {
    for (; t < until; t += 2) drift.add(day + from_seconds(t), 0.003 + later - 5e-5 * t);
  };
  go(307, 0);
  t = 3600;
  go(4000, 0);
  EXPECT_NEAR(to_seconds(drift.correction()), -5e-5 * 4000, 8e-3) << "known after 100 s";
  go(4200, 0.02);
  EXPECT_EQ(drift.rate(), 0);
  go(6000, 0.02);
  EXPECT_NEAR(drift.rate(), 5e-5, 1e-6);
  EXPECT_NEAR(to_seconds(drift.correction()), -5e-5 * 6000, 8e-3);
}

TEST(SensorClocks, ADriftOfAnotherRecordingIsForgotten) {
  for (const int stretches : {200, 203}) {  // whole blocks, and one that is being filled
    ClockDrift drift;
    for (int k = 0; k < stretches; ++k) drift.add(day + seconds(2 * k), 0.003 - 1e-4 * k);
    EXPECT_LT(to_seconds(drift.correction()), -0.01);
    drift.add(day, 0.003);
    EXPECT_EQ(drift.correction(), Duration(0));
    EXPECT_EQ(drift.rate(), 0);
  }
}

TEST(SensorClocks, DelaysThatStepOrGrowIntoAQueueAreNoDrift) {
  Robot robot;
  robot.length = seconds(300);
  const auto steps = [](double t) { return t > 100 ? 0.008 : 0; };
  const auto warms = [](double t) { return 0.008 * (1 - std::exp(-t / 60)); };
  const auto queue = [](double t) { return 1e-3 * t; };
  const auto queue_that_is_read = [](double t) { return 1e-3 * std::fmod(t, 7); };
  for (const std::function<double(double)>& later : std::vector<std::function<double(double)>>{steps, warms, queue, queue_that_is_read}) {
    SensorClocks clocks;
    auto arrivals = robot.arrivals();
    for (auto& a : arrivals) {
      if (a.m.index() != 1) continue;
      const double since = to_seconds(a.measured - day);
      a.at += from_seconds(later(since));
    }
    std::ranges::stable_sort(arrivals, {}, &Robot::Arrival::at);
    for (const auto& a : arrivals) {
      Measurement m = a.m;
      clocks.note(m, a.at);
      clocks.correct(m, a.at);
      ASSERT_EQ(stamp_of(m), stamp_of(a.m));
    }
    EXPECT_EQ(clocks.drift_finding(Sensor::legs), "");
  }
}

}  // namespace sensor_clocks_test
}  // namespace kilvo::lab
