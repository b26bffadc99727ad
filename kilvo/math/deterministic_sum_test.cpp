#include "kilvo/math/deterministic_sum.hpp"

#include <gtest/gtest.h>
#include <vector>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace deterministic_sum_test {

std::vector<double> values_of_all_sizes(std::size_t count) {
  test::Random random(1);
  std::vector<double> out(count);
  for (double& v : out) v = random.normal() * std::exp(random.uniform(-20, 20));
  return out;
}

double sum_with(int threads, const std::vector<double>& values, std::size_t block) {
  return Workers(threads).sum(values.size(), block, 0.0, [&](std::size_t first, std::size_t last) {
    double part = 0;
    for (std::size_t i = first; i < last; ++i) part += values[i];
    return part;
  });
}

TEST(Workers, SumIsTheSameToTheBitForAnyNumberOfThreads) {
  const std::vector<double> values = values_of_all_sizes(100003);
  const double one = sum_with(1, values, 256);
  for (const int threads : {2, 4, 0}) {
    for (int repeat = 0; repeat < 20; ++repeat) EXPECT_EQ(sum_with(threads, values, 256), one) << threads;
  }
  // The values are such that another order of addition would show.
  EXPECT_NE(sum_with(1, values, 100), one);
}

TEST(Workers, EachItemIsVisitedOnceInBlocksOfTheGivenSize) {
  for (const int threads : {1, 3}) {
    for (const std::size_t items : {std::size_t{1}, std::size_t{255}, std::size_t{256}, std::size_t{257}, std::size_t{1000}}) {
      std::vector<int> visits(items, 0);
      const std::size_t blocks = Workers(threads).sum(items, 256, std::size_t{0}, [&](std::size_t first, std::size_t last) {
        EXPECT_LE(last - first, 256U);
        for (std::size_t i = first; i < last; ++i) ++visits[i];
        return std::size_t{1};
      });
      EXPECT_EQ(visits, std::vector<int>(items, 1));
      EXPECT_EQ(blocks, (items + 255) / 256);
    }
  }
}

TEST(Workers, SumOfNothingIsZeroAndCallsNothing) {
  for (const int threads : {1, 2, 4}) {
    EXPECT_EQ(Workers(threads).sum(0, 256, 7, [](std::size_t, std::size_t) { return 1; }), 7);
  }
}

}  // namespace deterministic_sum_test
}  // namespace kilvo
