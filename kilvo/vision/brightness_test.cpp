#include "kilvo/vision/brightness.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace brightness_test {

std::vector<double> noisy(std::size_t count, double around, double sigma, std::mt19937& random) {
  std::normal_distribution<double> normal(around, sigma);
  std::vector<double> out(count);
  for (double& x : out) x = normal(random);
  return out;
}

TEST(Brightness, PatchesThatShowSomethingElseDoNotPull) {
  std::mt19937 random(1);
  std::vector<double> logs = noisy(70, 0.3, 0.005, random);
  const std::vector<double> others = noisy(30, 0.5, 0.1, random);
  logs.insert(logs.end(), others.begin(), others.end());
  EXPECT_NEAR(brightness_of(logs).log, 0.3, 0.002);
  EXPECT_GT(brightness_of(logs).doubt(0.5), 100);
  EXPECT_EQ(brightness_of(logs).doubt(0.301), 1);
}

TEST(Brightness, TheDeviationIsThatOfManyTrials) {
  std::mt19937 random(2);
  double squares = 0;
  constexpr int trials = 400;
  for (int k = 0; k < trials; ++k) {
    const Brightness b = brightness_of(noisy(100, -0.2, 0.01, random));
    squares += (b.log + 0.2) * (b.log + 0.2) / (b.sigma * b.sigma) / trials;
  }
  EXPECT_GT(squares, 0.6);
  EXPECT_LT(squares, 1.6);
}

TEST(Brightness, OneOrEqualOnesAreTakenAsTheyAre) {
  EXPECT_EQ(brightness_of({0.4}).log, 0.4);
  EXPECT_DOUBLE_EQ(brightness_of({0.4, 0.4, 0.4}).log, 0.4);
  EXPECT_GT(brightness_of({0.4, 0.4, 0.4}).sigma, 0);
}

}  // namespace brightness_test
}  // namespace kilvo
