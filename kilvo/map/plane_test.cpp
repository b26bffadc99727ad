#include "kilvo/map/plane.hpp"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"
#include "tests/helpers/surface_groups.hpp"

namespace kilvo {
namespace plane_test {

constexpr double max_roughness = 0.01;  // m

std::optional<Plane> fit(const Moments& moments, const Eigen::Vector3d& origin) { return fit_plane(moments, origin, 8, max_roughness); }

// A rectangle of 0.9 m x 0.5 m somewhere.
struct FlatPatch {
  Eigen::Vector3d centre, n, u, v;
};

FlatPatch random_patch(test::Random& random) {
  const Eigen::Matrix3d R = random.rotation().matrix();
  return {random.vector3(20), R.col(0), R.col(1), R.col(2)};
}

Moments moments_of(const std::vector<PointGroup>& groups, const Eigen::Vector3d& origin) {
  Moments m;
  for (const PointGroup& g : groups) m.add(g, origin);
  return m;
}

std::vector<PointGroup> noisy_points(test::Random& random, const FlatPatch& p, int count, double sigma) {
  std::vector<PointGroup> groups;
  for (int i = 0; i < count; ++i) {
    PointGroup g;
    g.mean = p.centre + random.uniform(-0.45, 0.45) * p.u + random.uniform(-0.25, 0.25) * p.v + random.normal(sigma) * p.n;
    g.noise = sigma * sigma * Eigen::Matrix3d::Identity();
    g.count = 1;
    groups.push_back(g);
  }
  return groups;
}

TEST(FitPlane, FindsAnExactPlaneExactly) {
  test::Random random(1);
  for (int i = 0; i < 50; ++i) {
    const FlatPatch p = random_patch(random);
    const Eigen::Vector3d origin = p.centre + random.vector3(0.3);
    const auto groups = test::groups_of(test::points_on(p.centre - 0.45 * p.u - 0.25 * p.v, 0.9 * p.u, 0.5 * p.v, 0.05), 0.25, 0.001);
    const auto plane = fit(moments_of(groups, origin), origin);
    ASSERT_TRUE(plane);
    EXPECT_NEAR(std::abs(plane->normal.cast<double>().dot(p.n)), 1, 1e-6);
    EXPECT_NEAR(std::abs(plane->axis.cast<double>().dot(p.u)), 1, 1e-6);
    EXPECT_LT((plane->centre - p.centre).norm(), 1e-10);
    EXPECT_LT(std::abs(plane->distance(p.centre + 0.3 * p.u - 0.2 * p.v)), 1e-6);
    EXPECT_NEAR(std::abs(plane->distance(p.centre + 0.1 * p.n)), 0.1, 1e-6);
    EXPECT_LT(plane->roughness_variance, 1e-9);
  }
}

TEST(FitPlane, ErrorsAreAsLargeAsItsCovarianceSays) {
  test::Random random(2);
  constexpr int trials = 300;
  for (const int count : {40, 400}) {
    double sum = 0;
    int used = 0;
    while (used < trials) {
      const FlatPatch p = random_patch(random);
      const auto plane = fit(moments_of(noisy_points(random, p, count, 0.02), p.centre), p.centre);
      ASSERT_TRUE(plane);
      // Points thicker by chance than their noise count as a rough surface, whose covariance is wider on purpose. Thickness and errors of
      // a fit are independent, so leaving those out does not choose among the errors.
      if (plane->roughness_variance > 0) continue;
      ++used;
      const double side = plane->normal.cast<double>().dot(p.n) > 0 ? 1 : -1;
      const Eigen::Vector3d n = side * p.n, u = plane->axis.cast<double>(), w = plane->normal.cross(plane->axis).cast<double>();
      const Eigen::Vector3d turn = plane->normal.cast<double>() - n;
      const double offset = n.dot(plane->centre - p.centre);
      sum += std::pow(turn.dot(u), 2) / static_cast<double>(plane->tilt_variance_1) +
             std::pow(turn.dot(w), 2) / static_cast<double>(plane->tilt_variance_2) +
             offset * offset / static_cast<double>(plane->offset_variance);
    }
    // Three degrees of freedom, 300 trials: 95 % within 3 +- 1.96 sqrt(6 / 300).
    EXPECT_NEAR(sum / trials, 3, 1.96 * std::sqrt(6.0 / trials)) << count << " points";
  }
}

// Of normal and centre: with the centre at the mean of the points the two are independent.
Eigen::Matrix<double, 6, 6> covariance_of(const Plane& plane) {
  const Eigen::Vector3d n = plane.normal.cast<double>(), u = plane.axis.cast<double>(), w = plane.normal.cross(plane.axis).cast<double>();
  Eigen::Matrix<double, 6, 6> C = Eigen::Matrix<double, 6, 6>::Zero();
  C.topLeftCorner<3, 3>() =
      static_cast<double>(plane.tilt_variance_1) * u * u.transpose() + static_cast<double>(plane.tilt_variance_2) * w * w.transpose();
  C.bottomRightCorner<3, 3>() = static_cast<double>(plane.offset_variance) * n * n.transpose();
  return C;
}

TEST(FitPlane, VarianceUnderAPointIsOffsetAndTilt) {
  test::Random random(3);
  for (int i = 0; i < 20; ++i) {
    const FlatPatch p = random_patch(random);
    const auto plane = fit(moments_of(noisy_points(random, p, 100, 0.02), p.centre), p.centre);
    ASSERT_TRUE(plane);
    const Eigen::Matrix<double, 6, 6> C = covariance_of(*plane);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<decltype(C)::PlainObject>(C).eigenvalues().minCoeff(), -1e-12);
    // r = n'(x - q): its variance by the 6x6 covariance of (n, q).
    const Eigen::Vector3d x = plane->centre + 0.4 * p.u - 0.2 * p.v;
    Eigen::Matrix<double, 6, 1> J;
    J << x - plane->centre, -plane->normal.cast<double>();
    EXPECT_NEAR(plane->variance_at(x), J.dot(C * J), 1e-5 * J.dot(C * J));
    EXPECT_GT(plane->variance_at(x), plane->variance_at(plane->centre));
  }
}

TEST(FitPlane, ARoughSurfaceIsAPlaneOfThatRoughnessUntilItIsTooRough) {
  test::Random random(4);
  for (const double bumps : {0.02, 0.06}) {
    const FlatPatch p = random_patch(random);
    std::vector<PointGroup> groups = noisy_points(random, p, 1000, bumps);
    for (PointGroup& g : groups) g.noise = 0.005 * 0.005 * Eigen::Matrix3d::Identity();
    const auto plane = fit(moments_of(groups, p.centre), p.centre);
    ASSERT_EQ(plane.has_value(), bumps < max_roughness) << bumps;
    EXPECT_TRUE(!plane || std::abs(std::sqrt(plane->roughness_variance) - std::sqrt(bumps * bumps - 0.005 * 0.005)) < 0.001);
  }
}

TEST(FitPlane, FewerPointsThanAskedForMakeNoPlane) {
  test::Random random(5);
  const FlatPatch p = random_patch(random);
  const auto groups = noisy_points(random, p, 8, 0.001);
  EXPECT_TRUE(fit(moments_of(groups, p.centre), p.centre));
  EXPECT_FALSE(fit(moments_of({groups.begin(), groups.begin() + 7}, p.centre), p.centre));
  EXPECT_FALSE(fit(Moments(), p.centre));
}

TEST(FitPlane, WhatIsNotFlatIsNoPlane) {
  const double sigma = 0.005, spacing = 0.05;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  const auto plane_through = [&](const std::vector<Eigen::Vector3d>& points) {
    return fit(moments_of(test::groups_of(points, 0.25, sigma), {0, 0, 0}), {0, 0, 0});
  };
  std::vector<Eigen::Vector3d> corner = test::points_on({0, 0, 0}, x, y, spacing);
  ASSERT_TRUE(plane_through(corner));
  for (const auto& wall : {test::points_on({0, 0, 0}, x, z, spacing), test::points_on({0, 0, 0}, y, z, spacing)}) {
    corner.insert(corner.end(), wall.begin(), wall.end());
    EXPECT_FALSE(plane_through(corner));
  }
  test::Random random(6);
  std::vector<Eigen::Vector3d> sphere, line;
  for (int i = 0; i < 500; ++i) sphere.push_back(0.4 * random.direction());
  for (int i = 0; i < 500; ++i) line.push_back(random.uniform(-0.5, 0.5) * Eigen::Vector3d(1, 2, 3).normalized() + random.vector3(sigma));
  EXPECT_FALSE(plane_through(sphere));
  EXPECT_FALSE(plane_through(line));
  EXPECT_FALSE(plane_through(std::vector<Eigen::Vector3d>(100, Eigen::Vector3d(0.1, 0.2, 0.3))));
}

TEST(Moments, GroupsStandForTheirPoints) {
  test::Random random(7);
  const Eigen::Vector3d origin(1000.5, -2000.5, 3.5);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 1000; ++i)
    points.push_back(origin + Eigen::Vector3d(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)));
  const Moments grouped = moments_of(test::groups_of(points, 0.25, 0.02), origin),
                single = moments_of(test::groups_of(points, 1e-6, 0.02), origin);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& x : points) mean += (x - origin) / 1000;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& x : points) covariance += (x - origin - mean) * (x - origin - mean).transpose() / 1000;
  for (const Moments& m : {grouped, single}) {
    EXPECT_NEAR(m.count(), 1000, 1e-9);
    EXPECT_LT((m.mean() - mean).norm(), 1e-12);
    EXPECT_LT((m.covariance() - covariance).norm(), 1e-11);
    EXPECT_LT((m.noise() - 4e-4 * Eigen::Matrix3d::Identity()).norm(), 2e-8);  // floats
  }
}

}  // namespace plane_test
}  // namespace kilvo
