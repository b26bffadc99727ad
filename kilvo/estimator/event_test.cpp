#include "kilvo/estimator/event.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <set>
#include <string>

namespace kilvo {
namespace event_test {

Time at(double s) { return Time(from_seconds(s)); }

TEST(Reasons, HaveNamesOfTheirOwnThatFitACsvFile) {
  std::set<std::string> names;
  for (const ReasonRow& row : reasons) {
    const std::string name = row.name;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_EQ(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz_"), std::string::npos) << name;
    EXPECT_NE(std::string(row.text), "") << name;
  }
}

TEST(Events, SayTheSensorTheValueAndTheCount) {
  EXPECT_EQ(text_of(Event{at(1), Sensor::lidar, Reason::clock_offset, -0.0123, 1, "lidar.time_offset to -0.0123"}),
            "lidar: its clock is -12.3 ms behind the IMU's (negative: ahead), and is corrected from now on: set "
            "lidar.time_offset to -0.0123");
  EXPECT_EQ(text_of(Event{at(1), Sensor::camera, Reason::agrees_with_nothing, 0, 25, {}}),
            "camera: 25 messages could not be used: agrees with nothing");
  EXPECT_EQ(text_of(Event{at(1), {}, Reason::legs_lost, 0, 2, {}}), "legs lost (2 times)");
  EXPECT_EQ(text_of(Event{at(1), {}, Reason::legs_lost, 0, 1, {}}), "legs lost");
}

TEST(Events, GoOutWhenTheyBecomeTrueAndWhenTheirCountHasDoubled) {
  EventLog log;
  for (int i = 0; i < 40; ++i) log.raise({at(i), Sensor::imu, Reason::imu_clock_stepped, 0.5, 1, "back"});
  log.raise({at(50), Sensor::camera, Reason::camera_turned, 7, 1, "1, 2, 3"});
  std::vector<std::uint64_t> counts;
  for (const Event& e : log.take()) counts.push_back(e.count);
  EXPECT_THAT(counts, testing::ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 16, 32, 1));
  EXPECT_FALSE(log.has_news());
  ASSERT_EQ(log.all().size(), 2u);
  EXPECT_EQ(log.all()[0].count, 40u);
  EXPECT_EQ(log.all()[0].t, at(39));
}

TEST(Events, OfWhatGoesOnAreKeptUpToDate) {
  EventLog log;
  log.state({at(1), Sensor::lidar, Reason::late, 0, 20, {}});
  log.state({at(2), Sensor::lidar, Reason::late, 0, 30, {}});
  EXPECT_EQ(log.take().size(), 1u);
  EXPECT_EQ(log.all().front().count, 30u);
  log.state({at(3), Sensor::lidar, Reason::late, 0, 40, {}});
  EXPECT_EQ(log.take().size(), 1u);
}

}  // namespace event_test
}  // namespace kilvo
