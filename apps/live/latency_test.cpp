#include "apps/live/latency.hpp"

#include <gtest/gtest.h>

namespace kilvo::live {
namespace latency_test {

TEST(Latency, QuantilesAreRightToAHundredth) {
  Latency latency;
  for (int i = 1; i <= 1000; ++i) latency.add(1e-5 * i);
  EXPECT_NEAR(latency.quantile(0.5), 5.00e-3, 5e-5);
  EXPECT_NEAR(latency.quantile(0.99), 9.90e-3, 1e-4);
  EXPECT_EQ(latency.quantile(1), 1e-2);
  EXPECT_EQ(latency.max(), 1e-2);
  EXPECT_EQ(latency.count(), 1000u);
}

TEST(Latency, NothingIsZeroAndNothingIsTooLongOrTooShort) {
  Latency latency;
  EXPECT_EQ(latency.quantile(0.5), 0);
  latency.add(1e6);
  latency.add(0);
  EXPECT_EQ(latency.max(), 1e6);
  EXPECT_LE(latency.quantile(0.5), 1e-7);
}

}  // namespace latency_test
}  // namespace kilvo::live
