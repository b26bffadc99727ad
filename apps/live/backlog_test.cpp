#include "apps/live/backlog.hpp"

#include <gtest/gtest.h>

namespace kilvo::live {
namespace backlog_test {

TEST(Backlog, OldScansAndImagesGiveWayTheImuDoesNot) {
  Backlog backlog;
  for (int i = 0; i < 100; ++i) {
    ImuSample imu;
    imu.t = time_from_ns(i);
    backlog.push({imu, Clock::now()});
    LidarScan scan;
    scan.t = time_from_ns(i);
    backlog.push({scan, Clock::now()});
  }
  std::vector<Arrival> all;
  ASSERT_TRUE(backlog.take(all));
  std::vector<std::int64_t> scans;
  std::size_t imus = 0;
  for (const Arrival& a : all) {
    if (sensor_of(a.m) == Sensor::lidar) scans.push_back(stamp_of(a.m).time_since_epoch().count());
    imus += sensor_of(a.m) == Sensor::imu ? 1 : 0;
  }
  EXPECT_EQ(imus, 100u);
  EXPECT_EQ(scans, (std::vector<std::int64_t>{98, 99})) << "the newest stay";
  EXPECT_EQ(backlog.dropped(), (std::array<std::uint64_t, sensor_count>{0, 0, 98, 0}));
  EXPECT_EQ(backlog.given_up(), 98u);
}

TEST(Backlog, GivesWhatIsLeftAfterItsEndAndThenNothing) {
  Backlog backlog;
  backlog.push({ImuSample{}, Clock::now()});
  backlog.close();
  backlog.push({ImuSample{}, Clock::now()});
  std::vector<Arrival> all;
  EXPECT_TRUE(backlog.take(all));
  EXPECT_EQ(all.size(), 1u);
  EXPECT_FALSE(backlog.take(all));
}

}  // namespace backlog_test
}  // namespace kilvo::live
