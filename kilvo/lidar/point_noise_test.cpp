#include "kilvo/lidar/point_noise.hpp"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace point_noise_test {

const LidarConfig config;

TEST(PointNoise, IsTheRangeNoiseAlongAndTheBearingNoiseAcrossTheBeam) {
  test::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d beam = random.uniform(0.3, 60) * random.direction(), along = beam.normalized();
    const Eigen::Vector3d across = along.unitOrthogonal();
    const Eigen::Matrix3d C = point_noise(beam, config);
    EXPECT_NEAR(along.dot(C * along), 0.02 * 0.02, 1e-12);
    EXPECT_NEAR(across.dot(C * across), std::pow(0.001 * beam.norm(), 2), 1e-12);
    EXPECT_NEAR(across.dot(C * along), 0, 1e-15);
    EXPECT_LT((C - C.transpose()).norm(), 1e-18);
    EXPECT_EQ(C.llt().info(), Eigen::Success);
  }
}

TEST(PointNoise, AlongANormalIsTheQuadraticForm) {
  test::Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d beam = random.uniform(0.3, 60) * random.direction(), n = random.direction();
    const double expected = n.dot(point_noise(beam, config) * n);
    EXPECT_NEAR(point_noise_along(n, beam, config), expected, 1e-12 * expected);
  }
}

}  // namespace point_noise_test
}  // namespace kilvo
