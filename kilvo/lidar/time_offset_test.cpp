#include "kilvo/lidar/time_offset.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace time_offset_test {

struct Walked {
  TimeOffset check;
  // A walking robot's sweeps, ten a second, seen `late` seconds after their stamps by a filter that believes them, with a gyroscope of a
  // scale of 1 + `scale`.
  Walked(double late, double scale, double amplitude, int sweeps) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal(0, 1e-4);
    const auto rate = [amplitude](double t) -> Eigen::Vector3d {
      return amplitude * Eigen::Vector3d(std::sin(11 * t), 0.7 * std::cos(11.5 * t + 1), 0.5 * std::sin(3 * t));
    };
    Eigen::Vector3d before = rate(0);
    for (int i = 1; i <= sweeps; ++i) {
      const Eigen::Vector3d now = rate(0.1 * i);
      const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
      check.add(late * (now - before) - 0.1 * scale * now + noise, now);
      before = now;
    }
  }
};

TEST(TimeOffset, IsFoundFromHowSweepsTurnTheState) {
  const auto found = Walked(0.01, 0, 0.3, 60).check.offset(0.002);
  ASSERT_TRUE(found);
  EXPECT_GT(*found, 0.009);
  EXPECT_LT(*found, 0.02) << "the half more that is usually lost, no more";
  EXPECT_LT(Walked(-0.01, 0, 0.3, 60).check.offset(0.002).value_or(0), -0.009);
}

TEST(TimeOffset, IsNotSeenWhereThereIsNone) {
  EXPECT_FALSE(Walked(0, 0, 0.3, 1000).check.offset(0.002));
  EXPECT_FALSE(Walked(0, 0.02, 0.3, 1000).check.offset(0.002)) << "a gyroscope's scale is none";
  EXPECT_FALSE(Walked(0.01, 0, 0.002, 1000).check.offset(0.002)) << "who stands learns nothing";
  EXPECT_FALSE(Walked(0.01, 0, 0.3, 10).check.offset(0.002)) << "nor who has only begun to move";
}

TEST(TimeOffset, OfAClockThatHasStartedToBeOffIsFound) {
  TimeOffset check = Walked(0, 0, 0.3, 500).check;
  EXPECT_FALSE(check.is_doubtful());
  Eigen::Vector3d before(0, 0, 0);
  for (int i = 1; i <= 150 && !check.offset(0.002); ++i) {
    const Eigen::Vector3d now(0.3 * std::sin(1.1 * i), 0.2 * std::cos(1.15 * i), 0);
    check.add(0.02 * (now - before), now);
    before = now;
  }
  EXPECT_TRUE(check.is_doubtful());
  EXPECT_TRUE(check.offset(0.002));
}

}  // namespace time_offset_test
}  // namespace kilvo
