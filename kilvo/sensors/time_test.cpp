#include "kilvo/sensors/time.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace time_test {

TEST(Time, KeepsEveryNanosecondOfAStampOfToday) {
  for (const std::int64_t ns : {0L, 1L, -1L, 1'700'000'000'123'456'789L, 9'223'372'036'854'775'807L}) {
    EXPECT_EQ(to_ns(time_from_ns(ns)), ns);
  }
  EXPECT_EQ((time_from_ns(1'700'000'000'000'000'001) - time_from_ns(1'700'000'000'000'000'000)).count(), 1);
}

TEST(Time, SecondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(from_seconds(0.1).count(), 100'000'000);
  EXPECT_EQ(from_seconds(-0.1).count(), -100'000'000);
  EXPECT_EQ(from_seconds(1e-9).count(), 1);
  EXPECT_EQ(from_seconds(0.6e-9).count(), 1);
  EXPECT_EQ(from_seconds(0.4e-9).count(), 0);
  EXPECT_EQ(from_seconds(-0.6e-9).count(), -1);
}

TEST(Time, SecondsComeBackExactly) {
  for (std::int64_t ns = -2'000'000'000; ns <= 2'000'000'000; ns += 12'345'677) {
    EXPECT_EQ(from_seconds(to_seconds(Duration(ns))).count(), ns);
  }
  EXPECT_DOUBLE_EQ(to_seconds(Duration(1'500'000'000)), 1.5);
}

}  // namespace time_test
}  // namespace kilvo
