#include "kilvo/lidar/degeneracy.hpp"

#include <gtest/gtest.h>

#include "kilvo/filter/update.hpp"
#include "kilvo/lidar/point_to_plane.hpp"
#include "tests/helpers/random.hpp"
#include "tests/helpers/surface_groups.hpp"

namespace kilvo {
namespace degeneracy_test {

const Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX(), y_axis = Eigen::Vector3d::UnitY(), z_axis = Eigen::Vector3d::UnitZ();

// Two walls along x, 2 m apart, and the floor; turned about z by `yaw` so that no axis of the state is along it. Optionally its end.
struct Corridor {
  double yaw = 0.3;
  bool with_end = false;
  Eigen::Vector3d along() const { return SO3::Exp({0, 0, yaw}) * x_axis; }
  std::vector<Eigen::Vector3d> points(double spacing) const {
    std::vector<Eigen::Vector3d> out;
    const auto add = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
      for (const Eigen::Vector3d& x : test::points_on(corner, u, v, spacing)) out.push_back(SO3::Exp({0, 0, yaw}) * x);
    };
    add({-8, -1.03, -1.21}, 16 * x_axis, 2.5 * z_axis);
    add({-8, 1.04, -1.21}, 16 * x_axis, 2.5 * z_axis);
    add({-8, -1.03, -1.21}, 16 * x_axis, 2.07 * y_axis);
    if (with_end) add({5.03, -1.03, -1.21}, 2.07 * y_axis, 2.5 * z_axis);
    return out;
  }
};

VoxelMap map_of(const Corridor& corridor) {
  VoxelMap map{MapConfig{}};
  const auto groups = test::groups_of(corridor.points(0.04), 0.25, 1e-4);
  for (int i = 0; i < 3; ++i) map.insert(groups, 0);
  return map;
}

std::vector<PointCluster> clusters_from(const Corridor& corridor, const SE3& T_WI) {
  std::vector<PointXYZI> points;
  for (const Eigen::Vector3d& x : corridor.points(0.1)) {
    const Eigen::Vector3f p = (T_WI.inverse() * x).cast<float>();
    points.emplace_back(p.x(), p.y(), p.z(), 0.0F);
  }
  return downsample(points, T_WI, 0.25);
}

struct Outcome {
  Update update;
  RegistrationReport report;
};

// `offset`: how far the prior is off along the corridor.
Outcome register_in(const Corridor& corridor, const Eigen::Vector3d& offset, double sigma) {
  const VoxelMap map = map_of(corridor);
  const SE3 truth{SO3::Exp({0.1, -0.2, 0.5}), {0.2, 0.1, 0.05}};
  const auto clusters = clusters_from(corridor, truth);
  const LidarConfig config;
  const Workers workers;
  Estimate prior;
  prior.x.R = truth.R;
  prior.x.p = truth.p + offset;
  prior.P.diagonal().setConstant(1e-6);
  prior.P.diagonal().segment<3>(at::p).setConstant(sigma * sigma);
  LidarModel model(map, clusters, Eigen::Vector3d::Zero(), PoseCovariance::Zero(), config, workers);
  Outcome out{update(prior, model, {}), {}};
  out.report = model.report();
  return out;
}

TEST(Degeneracy, ThreeWallsHoldEveryDirection) {
  Corridor corridor;
  corridor.with_end = true;
  const Outcome o = register_in(corridor, {0.02, 0.01, -0.02}, 0.05);
  EXPECT_EQ(o.report.degeneracy.weak_count, 0);
  EXPECT_GT(o.report.degeneracy.smallest_share, 0.002);
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::sqrt(o.update.posterior.P(at::p + i, at::p + i)), 0.003);
}

TEST(Degeneracy, ACorridorIsWeakAlongItselfAndNowhereElse) {
  const Corridor corridor;
  const Outcome o = register_in(corridor, Eigen::Vector3d::Zero(), 0.05);
  ASSERT_EQ(o.report.degeneracy.weak_count, 1);
  const Eigen::Matrix<double, 6, 1> weak = o.report.degeneracy.directions.col(0);
  EXPECT_NEAR(weak.norm(), 1, 1e-12);
  EXPECT_LT(weak.tail<3>().cross(corridor.along()).norm(), 1e-3);
  EXPECT_LT(weak.head<3>().norm(), 3e-3);  // cells at the edges hold a little of two surfaces
}

TEST(Degeneracy, TheUpdateLeavesTheWeakDirectionAloneAndHoldsTheOthers) {
  const Corridor corridor;
  const double sigma = 0.05;
  const Eigen::Vector3d along = corridor.along(), across = z_axis.cross(along);
  const Outcome o = register_in(corridor, 0.05 * along + 0.03 * across - 0.02 * z_axis, sigma);
  const SE3 truth{SO3::Exp({0.1, -0.2, 0.5}), {0.2, 0.1, 0.05}};
  const Eigen::Vector3d error = o.update.posterior.x.p - truth.p;
  EXPECT_NEAR(error.dot(along), 0.05, 1e-3);
  EXPECT_NEAR(error.dot(across), 0, 1e-3);
  EXPECT_NEAR(error.z(), 0, 1e-3);
  const Eigen::Matrix3d P = o.update.posterior.P.block<3, 3>(at::p, at::p);
  EXPECT_NEAR(std::sqrt(along.dot(P * along)), sigma, 1e-4);
  EXPECT_LT(std::sqrt(across.dot(P * across)), 0.002);
  EXPECT_LT(std::sqrt(P(2, 2)), 0.002);
}

TEST(Degeneracy, FakedInformationDoesNotCount) {
  // A measures x only by what noisy normals fake.
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Identity() * 1e6, fake = Eigen::Matrix<double, 6, 6>::Zero();
  A(3, 3) = fake(3, 3) = 1e5;
  EXPECT_EQ(find_degeneracy({A, Eigen::Matrix<double, 6, 6>::Zero()}, 0.002, {}).weak_count, 0);
  const Degeneracy d = find_degeneracy({A, fake}, 0.002, {});
  ASSERT_EQ(d.weak_count, 1);
  EXPECT_NEAR(std::abs(d.directions(3, 0)), 1, 1e-9);
}

// b of an error along x is what real rows make of it; faked rows see none of it.
TEST(Degeneracy, AloneWhatSweepsConfirmIsKeptAndTellsTheWholeError) {
  constexpr double real = 800, faked = 100, error = 0.02;
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Identity() * 1e6, fake = Eigen::Matrix<double, 6, 6>::Zero();
  A(3, 3) = real + 2 * faked;
  fake(3, 3) = faked;
  BlindDirections before;
  Degeneracy d = find_degeneracy({A, fake}, 0.002, before);
  ASSERT_EQ(d.weak_count, 1);
  EXPECT_NEAR(d.real[0], real, 1e-6);
  EXPECT_NEAR(d.kept[0], real, 1e-6) << "of one sweep it is the mean";
  before.see({A, fake}, d);
  d = find_degeneracy({A, fake}, 0.002, before);
  EXPECT_NEAR(d.kept[0], real, 1e-6);
  const auto projected = [&](bool alone) {
    Information<6> info;
    info.A = A;
    info.b(3) = real * error;
    project_out(d, Eigen::Matrix<double, 6, 6>::Identity() * 1e-6, alone, info);
    return info;
  };
  EXPECT_NEAR(projected(false).A(3, 3), 0, 1e-6);
  const Information<6> kept = projected(true);
  EXPECT_NEAR(kept.b(3) / kept.A(3, 3), error, 1e-9);
  EXPECT_NEAR(kept.A(3, 3), real * real / (real + 2 * faked) / 10, 1e-6) << "ten sweeps err alike";
}

// A sweep in a tunnel along `axis`: planes all around it whose normals are off by the noise of `tilt` rad each.
SweepInformation sweep_in_tunnel(const Eigen::Vector3d& axis, double tilt, test::Random& random) {
  constexpr int planes = 300;
  constexpr double weight = 1e4;  // 1/m^2, of a row
  const Eigen::Vector3d side = axis.unitOrthogonal(), up = axis.cross(side);
  SweepInformation out;
  out.planes = planes;
  for (int i = 0; i < planes; ++i) {
    const double angle = random.uniform(0, 6.28);
    const Eigen::Vector3d normal = std::cos(angle) * side + std::sin(angle) * up, across = axis.cross(normal);
    const Eigen::Vector3d p = random.uniform(-8, 8) * axis + random.uniform(-1, 1) * across + 1.5 * normal;
    const auto row = [&p](const Eigen::Vector3d& n) { return (Eigen::Matrix<double, 6, 1>() << p.cross(n), n).finished(); };
    const Eigen::Matrix<double, 6, 1> J = row(normal + random.normal(tilt) * axis + random.normal(tilt) * across);
    out.A += weight * J * J.transpose();
    for (const Eigen::Vector3d& n : {axis, across}) out.fake += weight * tilt * tilt * row(n) * row(n).transpose();
  }
  return out;
}

// Nothing measures along the tunnel: what is uncertain there stays so, however often it is looked at.
TEST(Degeneracy, SweepsInARowDoNotLearnWhatNoneOfThemMeasures) {
  test::Random random(3);
  BlindDirections blind;
  PoseCovariance P = PoseCovariance::Identity() * 1e-8;
  P.bottomRightCorner<3, 3>().setIdentity();
  for (int i = 0; i < 500; ++i) {
    const SweepInformation sweep = sweep_in_tunnel(x_axis, 0.01, random);
    const Degeneracy d = find_degeneracy(sweep, 0.002, blind);
    ASSERT_EQ(d.weak_count, 1);
    Information<6> info;
    info.A = sweep.A;
    project_out(d, P, true, info);
    P = (P.inverse() + info.A).inverse().eval();
    P.diagonal().array() += 1e-8;
    blind.see(sweep, d);
  }
  EXPECT_GT(std::sqrt(P(3, 3)), 0.4) << "0.02 when each sweep finds the direction by itself";
  EXPECT_LT(std::sqrt(P(4, 4)), 0.01);
  EXPECT_LT(std::sqrt(P(5, 5)), 0.01);
}

// What is kept of a weak direction, and how much of the prior's error along it an update by that replaces.
TEST(Degeneracy, SaysHowMuchOfAWeakDirectionIsTakenFromTheMap) {
  SweepInformation sweep;
  sweep.A.diagonal() << 1e6, 1e6, 1e6, 1e3, 1e6, 1e6;
  sweep.fake(3, 3) = 200;
  const Degeneracy d = find_degeneracy(sweep, 0.002, {});
  ASSERT_EQ(d.weak_count, 1);
  for (const double sigma : {0.01, 1.0}) {
    for (const bool alone : {false, true}) {
      Information<6> info;
      info.A = sweep.A;
      const PoseCovariance P = sigma * sigma * PoseCovariance::Identity();
      const std::array<double, 6> taken = project_out(d, P, alone, info);
      EXPECT_EQ(taken[0] > 0, alone);
      EXPECT_NEAR(taken[0], info.A(3, 3) / (info.A(3, 3) + 1 / (sigma * sigma)), 1e-9);
      EXPECT_NEAR(weak_part(d, taken)(3, 3), taken[0], 1e-9);
      EXPECT_EQ(taken[1], 0);
    }
  }
}

TEST(Degeneracy, ABendTurnsTheWeakDirection) {
  test::Random random(4);
  BlindDirections blind;
  const auto see = [&](const Eigen::Vector3d& axis) {
    const SweepInformation sweep = sweep_in_tunnel(axis, 0.01, random);
    const Degeneracy d = find_degeneracy(sweep, 0.002, blind);
    blind.see(sweep, d);
    return d;
  };
  for (int i = 0; i < 50; ++i) see(x_axis);
  const Eigen::Vector3d bent = SO3::Exp({0, 0, 0.2}) * x_axis;
  const Degeneracy d = see(bent);
  EXPECT_TRUE(d.turned);
  EXPECT_LT(d.directions.col(0).tail<3>().cross(bent).norm(), 0.01);
  // What is uncertain along the old one does not look measured from the new one.
  Eigen::Matrix<double, 6, 1> across = Eigen::Matrix<double, 6, 1>::Zero();
  across.tail<3>() = z_axis.cross(bent);
  EXPECT_NEAR(across.dot(d.doubt[0] * across), 0.04, 0.01);
}

TEST(Degeneracy, AShareThatScattersAroundZeroIsNotKept) {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Identity() * 1e6, fake = Eigen::Matrix<double, 6, 6>::Zero();
  fake(3, 3) = 1000;
  BlindDirections blind;
  double kept = 0;
  for (int i = 0; i < 200; ++i) {
    A(3, 3) = 2000 + (i % 2 == 0 ? 900 : -900);
    const Degeneracy d = find_degeneracy({A, fake}, 0.002, blind);
    ASSERT_EQ(d.weak_count, 1);
    blind.see({A, fake}, d);
    kept += d.kept[0] / 200;
  }
  EXPECT_LT(kept, 60) << "of 900 in every second sweep";
}

// Beside legs: 450 +- 450 in 40 sweeps that err alike in tens is chance, 450 +- 45 is not.
TEST(Degeneracy, OnlyWhatIsMoreThanChanceIsConfirmed) {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Identity() * 1e6, fake = Eigen::Matrix<double, 6, 6>::Zero();
  fake(3, 3) = 1000;
  const auto confirmed = [&](double scatter, int sweeps) {
    BlindDirections blind;
    for (int i = 0;; ++i) {
      A(3, 3) = 2000 + 450 + (i % 2 == 0 ? scatter : -scatter);
      const Degeneracy d = find_degeneracy({A, fake}, 0.002, blind);
      if (i == sweeps) return blind.confirmed_with(d.smallest_share, 3);
      blind.see({A, fake}, d);
    }
  };
  EXPECT_EQ(confirmed(450, 40), 0);
  // 1 - 3^2 * (45 / 450)^2 * 10 / 31
  EXPECT_NEAR(confirmed(45, 40), 1 - 0.09 * 10 / 31, 0.005);
  EXPECT_EQ(confirmed(45, 5), 0) << "few sweeps do not show their scatter";
}

TEST(Degeneracy, WithoutAnyInformationNothingBreaks) {
  const Eigen::Matrix<double, 6, 6> none = Eigen::Matrix<double, 6, 6>::Zero();
  const Degeneracy d = find_degeneracy({none, none}, 0.002, {});
  Information<6> info;
  project_out(d, none, false, info);
  EXPECT_TRUE(info.A.allFinite());
  EXPECT_EQ(weak_part(d).norm(), 0);
}

TEST(Degeneracy, ProjectingOutLeavesNothingAlongTheWeakDirectionInAnyUnits) {
  test::Random random(1);
  Degeneracy d;
  d.lever = 3;
  d.directions.col(0) = random.vector<6>().normalized();
  d.weak_count = 1;
  d.doubt[0].setZero();
  Information<6> info;
  info.A = 1e6 * random.covariance<6>(1);
  info.b = 1e3 * random.vector<6>();
  project_out(d, Eigen::Matrix<double, 6, 6>::Identity() * 1e-6, false, info);
  Eigen::Matrix<double, 6, 1> own = d.directions.col(0);
  own.head<3>() /= d.lever;  // the pose error (rad, m) along it
  EXPECT_LT((info.A * own).norm(), 1e-9 * info.A.norm());
  EXPECT_LT(std::abs(info.b.dot(own)), 1e-9 * info.b.norm());
  EXPECT_EQ(info.A, info.A.transpose());
  // weak_part keeps exactly that error, and is a projection.
  const Eigen::Matrix<double, 6, 6> W = weak_part(d);
  EXPECT_LT((W * own - own).norm(), 1e-12);
  EXPECT_LT((W * W - W).norm(), 1e-12);
}

}  // namespace degeneracy_test
}  // namespace kilvo
