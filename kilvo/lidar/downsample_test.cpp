#include "kilvo/lidar/downsample.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <map>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace downsample_test {

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

TEST(Downsample, ASurfaceAlongAFaceIsNotCutInTwoByItsNoise) {
  test::Random random(2);
  // A floor 1 cm below the face z = 0, with 2 cm of noise: a third of its points are above.
  std::vector<PointXYZI> points;
  const auto coordinate = [&random] { return static_cast<float>(random.uniform(-1, 1)); };
  for (int i = 0; i < 4000; ++i) points.emplace_back(coordinate(), coordinate(), static_cast<float>(-0.01 + random.normal(0.02)), 0.0F);
  const auto mean_heights = [&points](double reach) {
    std::vector<double> out;
    for (const PointCluster& c : downsample(points, SE3{}, 0.25, reach)) out.push_back(c.mean.z());
    return out;
  };
  const auto cut = mean_heights(0), whole = mean_heights(0.06);
  EXPECT_EQ(cut.size(), 2 * whole.size());
  for (const double z : whole) EXPECT_NEAR(z, -0.01, 4 * 0.02 / std::sqrt(30.0));
  EXPECT_GT(*std::max_element(cut.begin(), cut.end()), 0.004);
}

TEST(Downsample, CellsThatMeetAtAFaceOnlyWithTheirRimsStayApart) {
  // A wall across the face x = 0.25: the cells' means are in their middles.
  std::vector<PointXYZI> points;
  for (int i = 0; i < 100; ++i) points.emplace_back(0.005F * static_cast<float>(i), 0.1F, 0.1F, 0.0F);
  EXPECT_EQ(downsample(points, SE3{}, 0.25, 0.06).size(), 2U);
}

TEST(Downsample, OfNothingIsNothingAndOfOnePointThatPoint) {
  EXPECT_TRUE(downsample({}, SE3{}, 0.25).empty());
  const std::vector<PointXYZI> one = {{1, 2, 3, 4}};
  const auto clusters = downsample(one, SE3{}, 0.25);
  ASSERT_EQ(clusters.size(), 1U);
  EXPECT_EQ(clusters[0].mean, Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(clusters[0].scatter.norm(), 0);
}

}  // namespace downsample_test
}  // namespace kilvo
