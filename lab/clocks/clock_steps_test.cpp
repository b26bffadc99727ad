// Clocks that are set while the sensors send.
#include <algorithm>
#include <gtest/gtest.h>
#include <vector>

#include "lab/clocks/sensor_clocks.hpp"
#include "tests/helpers/arrivals.hpp"

namespace kilvo::lab {
namespace clock_steps_test {

using namespace test_arrivals;

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

void expect_no_step(const std::vector<Robot::Arrival>& arrivals) {
  SensorClocks clocks;
  const Result result = result_of(clocks, arrivals, Duration(0));
  for (const Sensor s : all_sensors) {
    EXPECT_EQ(clocks.steps(s), 0) << name_of(s);
    EXPECT_EQ(result.worst[index_of(s)], 0) << name_of(s);
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
    expect_no_step(arrivals);
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
  expect_no_step(arrivals);
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
    if (a.m.index() == 1 && a.measured > day + seconds(5)) set_ahead(a.m, milliseconds(150));
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
    expect_no_step(arrivals);
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
    if (a.m.index() == 1 && a.measured > day + seconds(5)) set_ahead(a.m, milliseconds(150));
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

}  // namespace clock_steps_test
}  // namespace kilvo::lab
