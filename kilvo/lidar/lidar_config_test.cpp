#include "kilvo/lidar/lidar_config.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/point_noise.hpp"
#include "tests/helpers/random.hpp"

namespace kilvo {
namespace lidar_config_test {

const LidarConfig config;

TEST(PointNoise, IsTheRangeNoiseAlongAndTheBearingNoiseAcrossTheBeam) {
  test::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d beam = random.uniform(0.3, 60) * random.direction(), along = beam.normalized();
    EXPECT_NEAR(point_noise_along(along, beam, config), 0.02 * 0.02, 1e-12);
    EXPECT_NEAR(point_noise_along(along.unitOrthogonal(), beam, config), std::pow(0.001 * beam.norm(), 2), 1e-12);
  }
}

TEST(PointNoise, AlongANormalIsTheQuadraticForm) {
  test::Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d beam = random.uniform(0.3, 60) * random.direction(), n = random.direction();
    const double expected = n.dot(test::point_noise(beam, config) * n);
    EXPECT_NEAR(point_noise_along(n, beam, config), expected, 1e-12 * expected);
  }
}

}  // namespace lidar_config_test
}  // namespace kilvo
