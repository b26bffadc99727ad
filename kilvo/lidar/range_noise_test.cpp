#include "kilvo/lidar/range_noise.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace range_noise_test {

/// Sweeps of a LiDAR at the origin of the IMU frame that sees patches of surfaces all around it, three metres away.
class Sweeps {
 public:
  explicit Sweeps(double sigma) : sigma_(sigma) {}

  /// A patch of a quarter of a metre; `corner`: half of it is another surface, at right angles.
  PointCluster patch(int points, bool corner) {
    const double around = 6.283 * uniform_(random_);
    const Eigen::Vector3d out(std::cos(around), std::sin(around), 0), across(-out.y(), out.x(), 0);
    std::vector<Eigen::Vector3d> all;
    for (int k = 0; k < points; ++k) {
      const double a = 0.25 * (uniform_(random_) - 0.5), b = 0.25 * (uniform_(random_) - 0.5);
      const Eigen::Vector3d x = 3 * out + (corner && a > 0 ? a * out : a * across) + b * Eigen::Vector3d::UnitZ();
      all.emplace_back(x + sigma_ * normal_(random_) * x.normalized());
    }
    return cluster_of(all);
  }

  std::vector<PointCluster> sweep(int patches, int points, double corners) {
    std::vector<PointCluster> out;
    for (int i = 0; i < patches; ++i) out.push_back(patch(points, uniform_(random_) < corners));
    return out;
  }

 private:
  static PointCluster cluster_of(const std::vector<Eigen::Vector3d>& points) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& x : points) mean += x / static_cast<double>(points.size());
    Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& x : points) S += (x - mean) * (x - mean).transpose();
    PointCluster out;
    out.mean = mean.cast<float>();
    out.count = static_cast<float>(points.size());
    out.scatter << static_cast<float>(S(0, 0)), static_cast<float>(S(0, 1)), static_cast<float>(S(0, 2)), static_cast<float>(S(1, 1)),
        static_cast<float>(S(1, 2)), static_cast<float>(S(2, 2));
    return out;
  }

  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
  double sigma_;
};

double learnt(double sigma, double described, int patches, int points, double corners) {
  Sweeps sweeps(sigma);
  RangeNoise noise;
  const LidarConfig config;
  for (int k = 0; k < 20; ++k) noise.add(sweeps.sweep(patches, points, corners), Eigen::Vector3d::Zero(), config);
  return noise.sigma(described);
}

TEST(RangeNoise, IsLearntFromFewAndFromManyPoints) {
  EXPECT_NEAR(learnt(0.04, 0.02, 500, 8, 0), 0.04, 0.002);
  EXPECT_NEAR(learnt(0.04, 0.02, 500, 40, 0), 0.04, 0.002);
  EXPECT_NEAR(learnt(0.025, 0.01, 500, 12, 0), 0.025, 0.00125);
}

TEST(RangeNoise, IsAtLeastTheDescribedOne) { EXPECT_EQ(learnt(0.01, 0.02, 500, 12, 0), 0.02); }

TEST(RangeNoise, IsNotThatOfEdges) { EXPECT_NEAR(learnt(0.02, 0.01, 500, 12, 0.2), 0.02, 0.004); }

TEST(RangeNoise, OfTooFewSurfacesIsTheDescribedOne) { EXPECT_EQ(learnt(0.04, 0.02, 20, 12, 0), 0.02); }

TEST(RangeNoise, OfTooFewPointsIsTheDescribedOne) { EXPECT_EQ(learnt(0.04, 0.02, 500, 7, 0), 0.02); }

}  // namespace range_noise_test
}  // namespace kilvo
