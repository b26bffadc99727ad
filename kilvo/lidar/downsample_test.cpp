#include "kilvo/lidar/downsample.hpp"

#include <array>
#include <gtest/gtest.h>
#include <map>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace {

std::vector<PointXYZI> random_points(test::Random& random, int count) {
  std::vector<PointXYZI> points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3f p = random.vector3(2).cast<float>();
    points.emplace_back(p.x(), p.y(), p.z(), 10.0F);
  }
  return points;
}

TEST(Downsample, EachClusterIsTheMomentsOfTheCellOfTheWorldThatItsPointsFallInto) {
  test::Random random(1);
  const auto points = random_points(random, 20000);
  const SE3 T_WI{random.rotation(), random.vector3(100)};
  const double cell = 0.25;
  std::map<std::array<double, 3>, std::vector<Eigen::Vector3d>> expected;
  for (const PointXYZI& point : points) {
    const Eigen::Vector3d p = point.head<3>().cast<double>(), w = (T_WI * p) / cell;
    expected[{std::floor(w.x()), std::floor(w.y()), std::floor(w.z())}].push_back(p);
  }
  const auto clusters = downsample(points, T_WI, cell);
  EXPECT_EQ(clusters.size(), expected.size());
  float total = 0;
  for (const PointCluster& c : clusters) {
    total += c.count;
    const Eigen::Vector3d w = (T_WI * c.mean.cast<double>()) / cell;
    const auto it = expected.find({std::floor(w.x()), std::floor(w.y()), std::floor(w.z())});
    ASSERT_NE(it, expected.end());
    ASSERT_EQ(static_cast<std::size_t>(c.count), it->second.size());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& p : it->second) mean += p / static_cast<double>(it->second.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const auto& p : it->second) scatter += (p - mean) * (p - mean).transpose();
    EXPECT_LT((c.mean.cast<double>() - mean).norm(), 2e-6);
    EXPECT_LT((c.scatter_matrix().cast<double>() - scatter).norm(), 1e-5 * (scatter.norm() + 0.01));
    EXPECT_EQ(c.scatter_matrix(), c.scatter_matrix().transpose());
  }
  EXPECT_EQ(total, 20000.0F);
}

TEST(Downsample, ClustersComeInTheOrderOfTheirFirstPoints) {
  const std::vector<PointXYZI> points = {{5, 5, 5, 0}, {0.1F, 0, 0, 0}, {5.01F, 5, 5, 0}, {-3, 0, 0, 0}, {0.11F, 0, 0, 0}};
  const auto clusters = downsample(points, SE3{}, 0.25);
  ASSERT_EQ(clusters.size(), 3U);
  EXPECT_NEAR(clusters[0].mean.x(), 5.005, 1e-6);
  EXPECT_NEAR(clusters[1].mean.x(), 0.105, 1e-6);
  EXPECT_NEAR(clusters[2].mean.x(), -3, 1e-6);
  EXPECT_EQ(clusters[0].count, 2);
}

TEST(Downsample, OfNothingIsNothingAndOfOnePointThatPoint) {
  EXPECT_TRUE(downsample({}, SE3{}, 0.25).empty());
  const std::vector<PointXYZI> one = {{1, 2, 3, 4}};
  const auto clusters = downsample(one, SE3{}, 0.25);
  ASSERT_EQ(clusters.size(), 1U);
  EXPECT_EQ(clusters[0].mean, Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(clusters[0].scatter.norm(), 0);
}

}  // namespace
}  // namespace kilvo
