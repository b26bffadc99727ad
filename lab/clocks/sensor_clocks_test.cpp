#include "lab/clocks/sensor_clocks.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

namespace kilvo::lab {
namespace sensor_clocks_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

const Time day = time_from_ns(1'700'000'000'000'000'000);
const Duration to_uptime = time_from_ns(1'000'000'000'000) - day;

/// What the sensors measure during `length`, in the order of arrival: IMU at 200 Hz, legs at 500 Hz, sweeps of 100 ms, images at 10 Hz,
/// each with its own delay and jitter.
struct Robot {
  std::array<Duration, sensor_count> clock{};  // added to the stamps
  std::array<Duration, sensor_count> delay{milliseconds(1), milliseconds(2), milliseconds(12), milliseconds(40)};
  std::array<Duration, sensor_count> begin{};  // after the first
  Duration length = seconds(3);

  struct Arrival {
    Measurement m;
    Time at, measured;
  };
  std::vector<Arrival> arrivals() const {
    std::vector<Arrival> out;
    for (const Sensor s : all_sensors) {
      const std::size_t i = index_of(s);
      const Duration period = milliseconds(std::array{5, 2, 100, 100}[i]);
      int n = 0;
      for (Time t = day + begin[i]; t < day + length; t += period) {
        const Duration jitter = milliseconds(++n % 4);
        const Time end = s == Sensor::lidar ? t + milliseconds(99) : t;
        out.push_back({measurement(s, t + clock[i]), end + delay[i] + jitter, t});
      }
    }
    std::ranges::stable_sort(out, {}, &Arrival::at);
    return out;
  }
  static Measurement measurement(Sensor s, Time t) {
    switch (s) {
      case Sensor::imu:
        return ImuSample{t};
      case Sensor::legs:
        return JointSample{t, {}, {0}, {}, {}};
      case Sensor::lidar:
        return LidarScan{t, {{1, 0, 0, 0, 0}, {1, 0, 0, 0, 99'000'000}}};
      case Sensor::camera:
        break;
    }
    return CameraImage{t, {}};
  }
};

/// Of all that is given out: the largest difference between a stamp and the time of measurement by the IMU's clock, s; and how many waited.
struct Result {
  std::array<double, sensor_count> worst{}, least{};
  std::array<int, sensor_count> withheld{}, given{};
};

Result result_of(SensorClocks& clocks, const std::vector<Robot::Arrival>& arrivals, Duration imu_clock) {
  Result out;
  for (const auto& a : arrivals) {
    Measurement m = a.m;
    const std::size_t i = m.index();
    clocks.note(m, a.at);
    if (!clocks.knows(sensor_of(m))) {
      ++out.withheld[i];
      continue;
    }
    clocks.correct(m, a.at);
    const double error = to_seconds(stamp_of(m) - (a.measured + imu_clock));
    out.worst[i] = out.given[i] == 0 ? error : std::max(out.worst[i], error);
    out.least[i] = out.given[i]++ == 0 ? error : std::min(out.least[i], error);
  }
  return out;
}

Result result_of(const Robot& robot) {
  SensorClocks clocks;
  return result_of(clocks, robot.arrivals(), robot.clock[0]);
}

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

// A LiDAR with its IMU that finds its PTP master, a computer that finds its time server.
TEST(SensorClocks, ThatAreSetWhileTheySendAreFollowed) {
  Robot robot;
  robot.length = seconds(10);
  constexpr std::array<int, sensor_count> most_withheld{14, 180, 6, 6};
  const std::vector<std::vector<std::size_t>> together{{0}, {1}, {2}, {3}, {0, 2}, {1, 3}, {0, 1, 2, 3}};
  for (const Duration step :
       {Duration(milliseconds(300)), Duration(-milliseconds(300)), Duration(seconds(60)), -to_uptime, Duration(-seconds(37))}) {
    const bool is_far_back = step < -seconds(2);
    for (const auto& sensors : together) {
      if (is_far_back && sensors.size() == sensor_count) continue;  // played again
      SCOPED_TRACE(testing::Message() << to_seconds(step) << " s, " << sensors.size() << " from " << sensors.front());
      auto arrivals = robot.arrivals();
      for (auto& a : arrivals) {
        if (std::ranges::count(sensors, a.m.index()) > 0 && a.measured > day + seconds(5))
          std::visit([step](auto& x) { x.t += step; }, a.m);
      }
      SensorClocks clocks;
      const Result result = result_of(clocks, arrivals, Duration(0));
      for (const Sensor s : all_sensors) {
        const std::size_t i = index_of(s);
        EXPECT_EQ(clocks.steps(s), std::ranges::count(sensors, i)) << name_of(s);
        EXPECT_LT(std::max(result.worst[i], -result.least[i]), 4e-3) << name_of(s) << ": the jitter of the delays is 3 ms";
        EXPECT_LE(result.withheld[i], (is_far_back ? 6 : 1) * most_withheld[i]) << name_of(s);
      }
    }
  }
}

void set_ahead(Measurement& m, Duration by) {
  std::visit([by](auto& x) { x.t += by; }, m);
}

void expect_right(const Result& result) {
  for (const Sensor s : all_sensors) {
    const std::size_t i = index_of(s);
    EXPECT_LT(std::max(result.worst[i], -result.least[i]), 4e-3) << name_of(s) << ": the jitter of the delays is 3 ms";
  }
}

// Two threads note what arrives, and a cloud waits until the times of its points are understood.
TEST(SensorClocks, KeepTheirStepsWhereOneMessageIsNotedLate) {
  for (const std::size_t late : {0U, 1U, 2U, 3U}) {
    Robot robot;
    robot.length = seconds(10);
    auto arrivals = robot.arrivals();
    for (auto& a : arrivals) {
      if (a.m.index() == 1 && a.measured > day + seconds(3)) set_ahead(a.m, seconds(60));
    }
    const auto at = std::ranges::find_if(arrivals, [&](const auto& a) { return a.m.index() == late && a.at > day + seconds(6); });
    const auto then = std::ranges::find_if(arrivals, [&](const auto& a) { return a.at > at->at + milliseconds(250); });
    std::rotate(at, at + 1, then);
    SensorClocks clocks;
    expect_right(result_of(clocks, arrivals, Duration(0)));
    EXPECT_EQ(clocks.steps(Sensor::legs), 1) << late;
    EXPECT_EQ(clocks.steps(Sensor::imu) + clocks.steps(Sensor::lidar) + clocks.steps(Sensor::camera), 0) << late;
  }
}

TEST(SensorClocks, KeepTheirStepsWhereTheClockOfArrivalIsSetBack) {
  for (const Duration back : {Duration(milliseconds(500)), Duration(seconds(60))}) {
    for (const bool legs_too : {false, true}) {
      Robot robot;
      robot.length = seconds(12);
      auto arrivals = robot.arrivals();
      for (auto& a : arrivals) {
        if (a.m.index() == 1 && a.measured > day + seconds(4)) set_ahead(a.m, milliseconds(150));
        if (a.at < day + seconds(8)) continue;
        if (a.m.index() == 1 && legs_too) set_ahead(a.m, -back);
        a.at -= back;
      }
      // What is set back with the recorder's clock comes before it is known that it is.
      std::erase_if(arrivals, [&](const auto& a) {
        return legs_too && a.m.index() == 1 && a.measured >= day + milliseconds(7990) && a.measured < day + milliseconds(8400);
      });
      SensorClocks clocks;
      expect_right(result_of(clocks, arrivals, Duration(0)));
      EXPECT_EQ(clocks.steps(Sensor::legs), legs_too ? 2 : 1) << to_seconds(back);
      EXPECT_EQ(clocks.steps(Sensor::imu) + clocks.steps(Sensor::lidar) + clocks.steps(Sensor::camera), 0) << to_seconds(back);
    }
  }
}

// Two seconds after a start: the sweep of the driver that starts again comes before its IMU does.
TEST(SensorClocks, OfALidarAndItsImuThatStartAgainAreFollowed) {
  for (const Duration step : {Duration(seconds(60)), -to_uptime, Duration(-seconds(37))}) {
    Robot robot;
    robot.length = seconds(14);
    auto arrivals = robot.arrivals();
    std::erase_if(arrivals, [](const auto& a) {
      return a.m.index() % 2 == 0 && a.measured > day + seconds(5) &&
             a.measured < day + (a.m.index() == 0 ? milliseconds(7250) : seconds(7));
    });
    for (auto& a : arrivals) {
      if (a.m.index() % 2 == 0 && a.measured > day + seconds(5)) set_ahead(a.m, step);
    }
    SensorClocks clocks;
    const Result result = result_of(clocks, arrivals, Duration(0));
    for (const Sensor s : all_sensors) EXPECT_EQ(clocks.steps(s), index_of(s) % 2 == 0 ? 1 : 0) << name_of(s) << ' ' << to_seconds(step);
    Measurement sweep = arrivals.back().m = Robot::measurement(Sensor::lidar, arrivals.back().measured + step);
    clocks.correct(sweep, arrivals.back().at);
    EXPECT_NEAR(to_seconds(stamp_of(sweep) - arrivals.back().measured), 0, 4e-3);
    EXPECT_GT(result.given[2], 80);
  }
}

// What the recorder's computer has for its clock is set: the stamps that go on are right, and those that are of the same computer are not.
TEST(SensorClocks, ThatAreSetWithTheClockOfArrivalAreToldFromThoseThatGoOn) {
  for (const bool legs_too : {false, true}) {
    Robot robot;
    robot.length = seconds(10);
    auto arrivals = robot.arrivals();
    // Those of the first third of a second are 60 s ahead, which the estimator refuses.
    std::erase_if(arrivals, [](const auto& a) { return a.m.index() == 1 && a.at >= day + seconds(5) && a.at < day + milliseconds(5320); });
    for (auto& a : arrivals) {
      if (a.at < day + seconds(5)) continue;
      if (legs_too && a.m.index() == 1) std::visit([](auto& x) { x.t += seconds(60); }, a.m);
      a.at += seconds(60);
    }
    SensorClocks clocks;
    const Result result = result_of(clocks, arrivals, Duration(0));
    EXPECT_EQ(clocks.steps(Sensor::legs), legs_too ? 1 : 0);
    EXPECT_EQ(clocks.steps(Sensor::imu) + clocks.steps(Sensor::lidar) + clocks.steps(Sensor::camera), 0);
    EXPECT_LT(std::max(result.worst[1], -result.least[1]), 4e-3);
  }
}

// Eight samples of the IMU in each of its messages.
TEST(SensorClocks, AreNotSetWhereTheImuComesInBurstsAndTheClockOfArrivalIsSet) {
  for (int offset = 0; offset < 8; ++offset) {
    Robot robot;
    robot.length = seconds(10);
    auto arrivals = robot.arrivals();
    int n = offset;
    for (auto& a : arrivals) {
      if (a.m.index() == 0) a.at += milliseconds(5 * (7 - n++ % 8));
    }
    std::ranges::stable_sort(arrivals, {}, &Robot::Arrival::at);
    for (auto& a : arrivals) {
      if (a.at >= day + seconds(5)) a.at += seconds(60);
    }
    SensorClocks clocks;
    const Result result = result_of(clocks, arrivals, Duration(0));
    for (const Sensor s : all_sensors) {
      EXPECT_EQ(clocks.steps(s), 0) << name_of(s);
      EXPECT_EQ(result.worst[index_of(s)], 0) << name_of(s);
    }
  }
}

// A computer that stands still for a second: what waited comes in a burst, and of the sweeps, the images and the legs there was no room for
// more than the last ones.
TEST(SensorClocks, AreNotSetWhereAllMessagesWaitedAndSomeWereDropped) {
  Robot robot;
  robot.length = seconds(10);
  auto arrivals = robot.arrivals();
  const Time from = day + seconds(5), until = day + seconds(6);
  std::erase_if(arrivals, [&](const auto& a) { return a.m.index() != 0 && a.at > from && a.at < until - milliseconds(20); });
  Duration place{};
  for (auto& a : arrivals) {
    if (a.at > from && a.at < until) a.at = until + (place += std::chrono::microseconds(50));
  }
  std::ranges::stable_sort(arrivals, {}, &Robot::Arrival::at);
  SensorClocks clocks;
  const Result result = result_of(clocks, arrivals, Duration(0));
  for (const Sensor s : all_sensors) {
    EXPECT_EQ(clocks.steps(s), 0) << name_of(s);
    EXPECT_EQ(result.worst[index_of(s)], 0) << name_of(s);
  }
}

TEST(SensorClocks, OfARecordingThatIsPlayedAgainAreItsOwn) {
  for (const Duration pause : {Duration(0), Duration(milliseconds(300)), Duration(seconds(3))}) {
    Robot robot;
    robot.length = seconds(10);
    auto arrivals = robot.arrivals();
    const std::size_t length = arrivals.size();
    for (std::size_t i = 0; i < length; ++i) {
      auto again = arrivals[i];
      again.at += seconds(10) + pause;
      arrivals.push_back(again);
    }
    std::ranges::stable_sort(arrivals, {}, &Robot::Arrival::at);
    SensorClocks clocks;
    EXPECT_EQ(result_of(clocks, arrivals, Duration(0)).worst[0], 0);
    for (const Sensor s : all_sensors) EXPECT_EQ(clocks.steps(s), 0) << name_of(s);
  }
}

TEST(SensorClocks, OfAnotherRecordingAreForgotten) {
  Robot robot;
  robot.length = seconds(10);
  auto arrivals = robot.arrivals();
  for (auto& a : arrivals) {
    if (a.m.index() == 1 && a.measured > day + seconds(5)) std::visit([](auto& x) { x.t += milliseconds(150); }, a.m);
  }
  SensorClocks clocks;
  result_of(clocks, arrivals, Duration(0));
  ASSERT_EQ(clocks.steps(Sensor::legs), 1);
  const Result again = result_of(clocks, robot.arrivals(), Duration(0));
  EXPECT_EQ(clocks.steps(Sensor::legs), 0);
  EXPECT_EQ(again.worst[1], 0);
}

// An IMU whose messages wait for a third of a second for a while, as those of a busy computer do: no clock was set.
TEST(SensorClocks, AreNotSetWhereTheImuComesLateForAWhile) {
  for (const int late : {80, 300}) {
    Robot robot;
    robot.length = seconds(10);
    auto arrivals = robot.arrivals();
    for (auto& a : arrivals) {
      if (a.m.index() == 0 && a.measured > day + seconds(4) && a.measured < day + seconds(5)) a.at += milliseconds(late);
    }
    std::ranges::stable_sort(arrivals, {}, &Robot::Arrival::at);
    SensorClocks clocks;
    const Result result = result_of(clocks, arrivals, Duration(0));
    for (const Sensor s : all_sensors) {
      EXPECT_EQ(clocks.steps(s), 0) << name_of(s);
      EXPECT_EQ(result.worst[index_of(s)], 0) << name_of(s);
    }
  }
}

TEST(SensorClocks, AreFollowedAfterASensorThatFellSilentAtItsStep) {
  Robot robot;
  robot.length = seconds(14);
  auto arrivals = robot.arrivals();
  std::erase_if(arrivals, [](const auto& a) { return a.m.index() == 1 && a.measured > day + milliseconds(4010); });
  for (auto& a : arrivals) {
    if (a.m.index() == 1 && a.measured > day + seconds(4)) set_ahead(a.m, seconds(60));
    if (a.m.index() == 2 && a.measured > day + seconds(11)) set_ahead(a.m, seconds(60));
  }
  SensorClocks clocks;
  for (const auto& a : arrivals) {
    clocks.note(a.m, a.at);
    if (!clocks.knows(Sensor::legs) && a.at > day + seconds(9)) clocks.wait_no_longer();
  }
  EXPECT_TRUE(clocks.knows_all());
  EXPECT_EQ(clocks.steps(Sensor::legs), 0);
  EXPECT_EQ(clocks.steps(Sensor::lidar), 1);
}

// For four seconds, in which the clock of the legs may have been set, or that of all the others: the IMU's messages tell after that.
TEST(SensorClocks, OfTheLegsAreNotJudgedWhileTheImuIsSilent) {
  Robot robot;
  robot.length = seconds(10);
  auto arrivals = robot.arrivals();
  std::erase_if(arrivals, [](const auto& a) { return a.m.index() == 0 && a.measured > day + seconds(4) && a.measured < day + seconds(8); });
  for (auto& a : arrivals) {
    if (a.m.index() == 1 && a.measured > day + seconds(5)) std::visit([](auto& x) { x.t += milliseconds(150); }, a.m);
  }
  SensorClocks clocks;
  for (const auto& a : arrivals) {
    clocks.note(a.m, a.at);
    EXPECT_TRUE(a.at >= day + seconds(8) || clocks.steps(Sensor::legs) == 0);
  }
  Measurement last = Robot::measurement(Sensor::legs, day + seconds(10) + milliseconds(150));
  clocks.correct(last, day + seconds(10));
  EXPECT_NEAR(to_seconds(stamp_of(last) - day), 10, 4e-3);
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
