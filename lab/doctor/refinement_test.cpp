// What is taken of a measured change, by what it says of itself.
#include "lab/doctor/refinement.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace kilvo::lab {
namespace refinement_test {

Refinement of(std::vector<double> change, std::vector<double> sigma, double largest = 1e9) {
  return refinement(Sensor::lidar, "mount", std::move(change), std::move(sigma), 0, largest, "deg");
}

TEST(Refinement, TakesNothingThatChanceExplains) {
  EXPECT_FALSE(of({0.5, -0.9, 0.7}, {1, 1, 1}).is_taken());
  EXPECT_FALSE(of({0.2}, {1}).is_taken());
}

TEST(Refinement, TakesNearlyAllOfWhatIsManyStandardDeviations) {
  const Refinement r = of({30, -20, 10}, {1, 1, 1});
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(r.taken[i] / r.change[i], 1, 0.011);
}

// With equal standard deviations the most likely variance is known: that of the change less that of the measurement.
TEST(Refinement, TakesTheShareThatAllComponentsShow) {
  const Refinement r = of({3.5, -2.5, 3.5}, {1, 1, 1});
  const double all = (3.5 * 3.5 + 2.5 * 2.5 + 3.5 * 3.5) / 3;
  EXPECT_NEAR(r.taken[0], (all - 1) / all * 3.5, 1e-6);
  EXPECT_NEAR(r.taken[2], (all - 1) / all * 3.5, 1e-6);
}

// A height that is off by much says nothing of the other two.
TEST(Refinement, TakesNoMoreOfAComponentThanItShowsByItself) {
  const Refinement r = of({0.5, -0.7, 6}, {1, 1, 1});
  EXPECT_EQ(r.taken[0], 0);
  EXPECT_EQ(r.taken[1], 0);
  EXPECT_GT(r.taken[2], 5);
  EXPECT_NEAR(of({2, 6, 6}, {1, 1, 1}).taken[0], 2 * (1 - 0.25), 1e-6);
}

TEST(Refinement, TakesLessOfWhatIsKnownLess) {
  const Refinement r = of({3, 3, 3}, {0.5, 1, 2});
  EXPECT_GT(r.taken[0], r.taken[1]);
  EXPECT_GT(r.taken[1], r.taken[2]);
  EXPECT_GT(r.taken[2], 0);
}

TEST(Refinement, KeepsWhatIsNotObservable) {
  const Refinement r = of({5, 5, 5}, {0.5, 0.5, 20}, 10);
  EXPECT_TRUE(r.observable);
  EXPECT_EQ(r.taken[2], 0);
  EXPECT_GT(r.taken[0], 4);
  EXPECT_FALSE(of({5, 5, 5}, {20, 20, 20}, 10).observable);
}

TEST(Refinement, ChangesASingleNumberOnlyWhereItIsSignificant) {
  EXPECT_FALSE(of({2.9}, {1}).is_taken());
  const Refinement r = of({4}, {1});
  EXPECT_TRUE(r.significant);
  EXPECT_NEAR(r.taken[0], 4 * 15.0 / 16, 1e-6);
}

// Over many descriptions that scatter as they like it is nearer to the truth than what is described, and than what was measured.
TEST(Refinement, IsNearerToTheTruthThanTheDescriptionAndTheMeasurement) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  double described = 0, measured = 0, taken = 0;
  for (int k = 0; k < 2000; ++k) {
    std::vector<double> truth, change;
    for (int i = 0; i < 3; ++i) {
      truth.push_back(1.2 * normal(random));
      change.push_back(truth.back() + normal(random));
    }
    const Refinement r = of(change, {1, 1, 1});
    for (std::size_t i = 0; i < 3; ++i) {
      described += truth[i] * truth[i];
      measured += std::pow(truth[i] - change[i], 2);
      taken += std::pow(truth[i] - r.taken[i], 2);
    }
  }
  EXPECT_LT(taken, 0.6 * described);
  EXPECT_LT(taken, 0.9 * measured);
}

}  // namespace refinement_test
}  // namespace kilvo::lab
