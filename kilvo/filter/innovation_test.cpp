#include "kilvo/filter/innovation.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace innovation_test {

// A prior of covariance P, and a measurement of covariance R whose error is `wrong` times larger.
double mean_of_innovations(double wrong, InnovationScale* scale) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Covariance P = Covariance::Identity();
  P.topLeftCorner<6, 6>() *= 4e-6;
  double sum = 0;
  constexpr int count = 2000;
  for (int n = 0; n < count; ++n) {
    Information<7> info;
    info.A = Eigen::Matrix<double, 7, 7>::Identity() / 1e-6;
    Eigen::Matrix<double, 7, 1> error;
    for (int i = 0; i < 7; ++i) error[i] = 2e-3 * normal(random) + wrong * 1e-3 * normal(random);
    info.b = info.A * error;
    const auto one = normalised_innovation(info, P);
    if (!one) return -1;
    sum += *one;
    if (scale != nullptr) scale->add(one);
  }
  return sum / count;
}

TEST(Innovation, IsOneOnAverageWhenBothSidesAreRight) { EXPECT_NEAR(mean_of_innovations(1, nullptr), 1, 0.03); }

TEST(Innovation, ShowsAnErrorThatTheMeasurementDoesNotKnowOf) {
  // (4 + 9) / 5
  EXPECT_NEAR(mean_of_innovations(3, nullptr), 2.6, 0.1);
}

TEST(Innovation, HasNoneWithoutThePose) {
  Information<7> info;
  EXPECT_FALSE(normalised_innovation(info, Covariance::Identity()));
}

TEST(InnovationScale, IsOneForARightSensorAndLargeForAWrongOne) {
  InnovationScale right, wrong, young;
  for (int i = 0; i < 100; ++i) right.add(0.5);
  mean_of_innovations(3, &wrong);
  for (int i = 0; i < 5; ++i) young.add(20);
  EXPECT_EQ(right.variance(), 1);
  EXPECT_GT(wrong.variance(), 8);
  EXPECT_EQ(young.variance(), 1) << "five measurements prove nothing";
}

TEST(InnovationScale, ForgetsWhatHasPassed) {
  InnovationScale scale;
  for (int i = 0; i < 100; ++i) scale.add(20);
  EXPECT_GT(scale.variance(), 100);
  for (int i = 0; i < 200; ++i) scale.add(0.5);
  EXPECT_EQ(scale.variance(), 1);
}

}  // namespace innovation_test
}  // namespace kilvo
