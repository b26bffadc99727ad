#include "kilvo/lidar/point_to_plane.hpp"

#include <gtest/gtest.h>

#include "kilvo/filter/update.hpp"
#include "tests/helpers/exact_map.hpp"
#include "tests/helpers/point_noise.hpp"
#include "tests/helpers/random_state.hpp"

namespace kilvo {
namespace point_to_plane_test {

TEST(PointToPlane, TheJacobianIsTheDerivativeAt200RandomStates) {
  test::Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const State x = test::random_state(random);
    const Eigen::Vector3d p_I = random.vector3(10), n_W = random.direction(), q_W = random.vector3(10);
    const PointToPlaneRow row = point_to_plane(x.pose(), p_I, n_W, q_W);
    EXPECT_NEAR(row.r, n_W.dot(x.R * p_I + x.p - q_W), 1e-13);
    constexpr double h = 1e-5;
    for (int i = 0; i < 6; ++i) {
      const ErrorVector d = h * ErrorVector::Unit(i);
      const double numeric =
          (point_to_plane(boxplus(x, d).pose(), p_I, n_W, q_W).r - point_to_plane(boxplus(x, -d).pose(), p_I, n_W, q_W).r) / (2 * h);
      EXPECT_NEAR(row.J[i], numeric, 1e-6 * row.J.norm() + 1e-9) << i;
    }
  }
}

// A noise-free scan of the room taken at rest from `T_WI`.
std::vector<PointXYZI> scan_from(const lab::AnalyticRoom& room, const SE3& T_WI, int count) {
  std::vector<PointXYZI> points;
  test::Random random(2);
  while (static_cast<int>(points.size()) < count) {
    const Eigen::Vector3d direction = random.direction();
    double nearest = 1e9;
    for (const lab::Rectangle& r : room.surfaces()) {
      const Eigen::Vector3d n = r.u.cross(r.v), d = T_WI.R * direction;
      const double range = n.dot(r.corner - T_WI.p) / n.dot(d);
      const Eigen::Vector3d x = T_WI.p + range * d - r.corner;
      const double a = x.dot(r.u) / r.u.squaredNorm(), b = x.dot(r.v) / r.v.squaredNorm();
      if (range > 0.05 && a >= 0 && a <= 1 && b >= 0 && b <= 1) nearest = std::min(nearest, range);
    }
    if (nearest > 100) continue;
    const Eigen::Vector3f p = (nearest * direction).cast<float>();
    points.emplace_back(p.x(), p.y(), p.z(), 0.0F);
  }
  return points;
}

struct Registered {
  Estimate posterior;
  bool converged;
  RegistrationReport report;
  std::vector<EpochInformation> epochs;
};

const SE3 truth{SO3::Exp({0.05, -0.1, 0.7}), {0.4, -0.3, 0.1}};

Registered register_scan(const VoxelMap& map, const std::vector<PointXYZI>& points, const State& guess, int threads,
                         const LidarConfig& lidar = {}) {
  const auto clusters = downsample(points, guess.pose(), lidar.voxel_size);
  const Workers workers(threads);
  Estimate prior;
  prior.x = guess;
  prior.P.diagonal().setConstant(1e-4);
  prior.P.diagonal().segment<3>(at::R).setConstant(0.03 * 0.03);
  prior.P.diagonal().segment<3>(at::p).setConstant(0.05 * 0.05);
  LidarModel model(map, clusters, Eigen::Vector3d::Zero(), PoseCovariance::Zero(), lidar, workers);
  UpdateConfig config;
  config.max_iterations = 20;
  const Update u = update(prior, model, config);
  return {u.posterior, u.converged, model.report(), model.by_epoch()};
}

State truth_state() {
  State x;
  x.R = truth.R;
  x.p = truth.p;
  return x;
}

TEST(LidarModel, InAnExactMapItFindsThePoseFromFarOff) {
  const lab::AnalyticRoom room({});
  const VoxelMap map = test::exact_map(room.surfaces(), SE3{});
  const auto points = scan_from(room, truth, 20000);
  test::Random random(3);
  for (int trial = 0; trial < 5; ++trial) {
    ErrorVector off = ErrorVector::Zero();
    off.head<3>() = 2 * std::numbers::pi / 180 * random.direction();
    off.segment<3>(at::p) = 0.05 * random.direction();
    const Registered r = register_scan(map, points, boxplus(truth_state(), off), 1);
    EXPECT_TRUE(r.converged);
    const ErrorVector left = boxminus(r.posterior.x, truth_state());
    EXPECT_LT(left.segment<3>(at::p).norm(), 2e-4);
    EXPECT_LT(left.head<3>().norm(), 0.01 * std::numbers::pi / 180);
    EXPECT_GT(r.report.matched, r.report.clusters / 2);
    EXPECT_EQ(r.report.degeneracy.weak_count, 0);
  }
}

TEST(LidarModel, TheResultIsTheSameToTheBitForAnyNumberOfThreads) {
  const lab::AnalyticRoom room({});
  const VoxelMap map = test::exact_map(room.surfaces(), SE3{});
  const auto points = scan_from(room, truth, 20000);
  State guess = truth_state();
  guess.p.x() += 0.03;
  const Registered one = register_scan(map, points, guess, 1);
  for (const int threads : {2, 4}) {
    const Registered many = register_scan(map, points, guess, threads);
    EXPECT_EQ(many.posterior.x.R.matrix(), one.posterior.x.R.matrix());
    EXPECT_EQ(many.posterior.x.p, one.posterior.x.p);
    EXPECT_EQ(many.posterior.P, one.posterior.P);
    EXPECT_EQ(many.report.rejected, one.report.rejected);
    EXPECT_EQ(many.report.chi2_per_row, one.report.chi2_per_row);
  }
}

TEST(LidarModel, WithNoiseAsConfiguredTheResidualsAreOfUnitVariance) {
  const lab::AnalyticRoom room({});
  const VoxelMap map = test::exact_map(room.surfaces(), SE3{});
  auto points = scan_from(room, truth, 20000);
  test::Random random(4);
  const LidarConfig lidar;
  for (PointXYZI& p : points) {
    const Eigen::Vector3d beam = p.head<3>().cast<double>();
    const Eigen::Matrix3d L = test::point_noise(beam, lidar).llt().matrixL();
    p.head<3>() += (L * random.vector3()).cast<float>();
  }
  const Registered r = register_scan(map, points, truth_state(), 1, lidar);
  EXPECT_NEAR(r.report.chi2_per_row, 0.95, 0.15);  // Huber weights take a little off
  const ErrorVector e = boxminus(r.posterior.x, truth_state());
  EXPECT_LT(e.head<6>().dot(r.posterior.P.topLeftCorner<6, 6>().ldlt().solve(e.head<6>())), 22.5);  // 99.9 % of chi-square with 6
}

TEST(LidarModel, PointsFarFromTheirPlanesAreRejectedAndCounted) {
  const lab::AnalyticRoom room({});
  const VoxelMap map = test::exact_map(room.surfaces(), SE3{});
  auto points = scan_from(room, truth, 5000);
  const Registered clean = register_scan(map, points, truth_state(), 1);
  // Something half a metre in front of what was a fifth of the view.
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].x() > 1.5F && std::abs(points[i].y()) < 1) points[i].head<3>() *= 0.85F;
  }
  const Registered r = register_scan(map, points, truth_state(), 1);
  EXPECT_LT(r.report.matched, clean.report.matched);
  EXPECT_LT(boxminus(r.posterior.x, truth_state()).segment<3>(at::p).norm(), 0.002);
}

TEST(LidarModel, WithoutAMapThereAreNoRows) {
  const lab::AnalyticRoom room({});
  const Registered r = register_scan(VoxelMap{MapConfig{}}, scan_from(room, truth, 1000), truth_state(), 1);
  EXPECT_EQ(r.report.matched, 0);
  EXPECT_EQ(r.report.rejected, 0);
  EXPECT_EQ(r.posterior.x.p, truth.p);
  EXPECT_TRUE(r.epochs.empty());
}

TEST(LidarModel, TheErrorOfAPlaneIsSharedByAllItsRows) {
  // One wall of few noisy points: it is known to 2 mm, and 2500 points on it do not know it better.
  const Eigen::Vector3d n = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  const std::vector<PointGroup> groups = test::groups_of(test::points_on({2.5, 0, 0}, y, z, 0.06), 0.25, 0.03);
  VoxelMap map{MapConfig{}};
  map.insert(groups, 0);
  const Plane* plane = map.plane_at({2.5, 0.5, 0.5});
  ASSERT_NE(plane, nullptr);
  std::vector<PointXYZI> points;
  for (const Eigen::Vector3d& x : test::points_on({2.5, 0, 0}, y, z, 0.02)) points.emplace_back(x.x(), x.y(), x.z(), 0);
  const auto clusters = downsample(points, SE3{}, 0.25);
  const LidarConfig lidar;
  const Workers workers;
  LidarModel model(map, clusters, Eigen::Vector3d::Zero(), PoseCovariance::Zero(), lidar, workers);
  Covariance P = Covariance::Zero();
  P.diagonal().head<6>().setConstant(1e-8);
  const Information<6> info = model(State{}, P);
  EXPECT_GT(info.rows, 10);
  const double known = n.dot(info.A.bottomRightCorner<3, 3>() * n);
  EXPECT_LT(known, 1.0 / static_cast<double>(plane->offset_variance));
  EXPECT_GT(known, 0.3 / static_cast<double>(plane->offset_variance));
}

TEST(LidarModel, TheBackOfASurfaceIsAnotherSurface) {
  const std::vector<Eigen::Vector3d> wall = test::points_on({2.5, 0, 0}, Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(), 0.02);
  const std::vector<PointGroup> groups = test::groups_of(wall, 0.25, 0.02);
  const LidarConfig lidar;
  const Workers workers;
  Covariance P = Covariance::Zero();
  P.diagonal().head<6>().setConstant(1e-4);
  const auto report_from = [&](const std::optional<Eigen::Vector3d>& seen_from, double x) {
    VoxelMap map{MapConfig{}};
    map.insert(groups, 0, seen_from);
    std::vector<PointXYZI> points;
    for (const Eigen::Vector3d& p : wall) points.emplace_back(p.x() - x, p.y(), p.z(), 0);
    const auto clusters = downsample(points, SE3{}, 0.25);
    LidarModel model(map, clusters, Eigen::Vector3d::Zero(), PoseCovariance::Zero(), lidar, workers);
    State at;
    at.p.x() = x;
    model(at, P);
    return model.report();
  };
  const Eigen::Vector3d before(0, 0, 0);
  const int all = report_from({}, 1).matched;
  EXPECT_GT(all, 10);
  EXPECT_EQ(report_from(before, 1).matched, all);
  EXPECT_EQ(report_from({}, 5).matched, all) << "two-sided";
  const RegistrationReport behind = report_from(before, 5);
  EXPECT_EQ(behind.matched, 0);
  EXPECT_EQ(behind.rejected, 0) << "nothing is known of that side";
  EXPECT_EQ(report_from(before, 2.52).matched, all) << "2 cm behind it, the pose known to 1 cm";
}

TEST(LidarModel, TheInformationByEpochAddsUpToAll) {
  const lab::AnalyticRoom room({});
  VoxelMap map{MapConfig{}};
  for (std::size_t i = 0; i < room.surfaces().size(); ++i) {
    const lab::Rectangle& r = room.surfaces()[i];
    map.insert(test::groups_of(test::points_on(r.corner, r.u, r.v, 0.04), 0.25, 1e-3), static_cast<std::uint32_t>(i % 3));
  }
  const auto points = scan_from(room, truth, 5000);
  const auto clusters = downsample(points, truth, 0.25);
  const LidarConfig lidar;
  const Workers workers;
  LidarModel model(map, clusters, Eigen::Vector3d::Zero(), PoseCovariance::Zero(), lidar, workers);
  Covariance P = Covariance::Zero();
  P.diagonal().head<6>().setConstant(1e-4);
  const Information<6> info = model(truth_state(), P);
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  for (const EpochInformation& e : model.by_epoch()) sum += e.A;
  EXPECT_EQ(model.by_epoch().size(), 3U);
  EXPECT_LT((sum - info.A).norm(), 1e-9 * info.A.norm());
}

// A corridor along x that has been there for long, and in it a board across: as it was a moment ago, and 6 cm nearer now.
struct CorridorWithABoard {
  static std::vector<Eigen::Vector3d> board(double x) {
    std::vector<Eigen::Vector3d> out;
    for (double y = -0.8; y < 0.8; y += 0.03) {
      for (double z = -0.7; z < 0.7; z += 0.03) out.emplace_back(x, y, z);
    }
    return out;
  }

  explicit CorridorWithABoard(bool is_new) {
    std::vector<Eigen::Vector3d> walls;
    for (double x = -3; x < 3; x += 0.05) {
      for (double s = -0.9; s < 0.9; s += 0.05) {
        for (const double side : {-1.2, 1.2}) walls.emplace_back(x, side, s), walls.emplace_back(x, s, side);
      }
    }
    add(walls);
    map.settle();
    add(board(3.1));
    if (!is_new) map.settle();
    map.see_through({}, {});  // the next sweep
    for (const auto& points : {walls, board(3.04)}) {
      for (const Eigen::Vector3d& x : points) scan.emplace_back(x.cast<float>().x(), x.cast<float>().y(), x.cast<float>().z(), 0.0F);
    }
  }

  double moved_along_it() const {
    const auto clusters = downsample(scan, SE3{}, LidarConfig{}.voxel_size);
    const Workers workers(1);
    Estimate prior;
    prior.P.diagonal().setConstant(1e-4);
    prior.P(at::p, at::p) = 0.03 * 0.03;
    LidarModel model(map, clusters, Eigen::Vector3d::Zero(), PoseCovariance::Zero(), {}, workers);
    model.doubt_new_surfaces(0.1);
    return update(prior, model, UpdateConfig{}).posterior.x.p.x();
  }

  VoxelMap map{MapConfig{}};
  std::vector<PointXYZI> scan;

 private:
  void add(const std::vector<Eigen::Vector3d>& points) {
    std::vector<PointGroup> groups;
    for (const Eigen::Vector3d& x : points) groups.push_back({x, Eigen::Matrix3d::Zero(), 1e-4 * Eigen::Matrix3d::Identity(), 1});
    map.insert(groups, 0, Eigen::Vector3d(0, 0, 0));
  }
};

TEST(LidarModel, AlongACorridorANewSurfaceMayBeAPersonWhoWalks) {
  EXPECT_GT(CorridorWithABoard(false).moved_along_it(), 0.05);
  EXPECT_LT(CorridorWithABoard(true).moved_along_it(), 0.02);
}

TEST(ToWorld, GroupsAreTheClustersSeenFromTheWorld) {
  test::Random random(5);
  std::vector<PointCluster> clusters(7);  // four together, and three
  for (PointCluster& c : clusters) {
    c.mean = random.vector3(5).cast<float>();
    c.count = static_cast<float>(random.uniform(1, 9));
    for (int i = 0; i < 6; ++i) c.scatter[i] = static_cast<float>(random.normal(1));
  }
  const SE3 T_WI{random.rotation(), random.vector3(10)};
  const Eigen::Vector3d p_IL(0.1, 0.2, 0.3);
  const auto groups = to_world(clusters, T_WI, p_IL, {});
  ASSERT_EQ(groups.size(), clusters.size());
  const Eigen::Matrix3d& R = T_WI.R.matrix();
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    const Eigen::Vector3d mean = clusters[i].mean.cast<double>();
    EXPECT_LT((groups[i].mean - T_WI * mean).norm(), 1e-12) << i;
    EXPECT_LT((groups[i].scatter - R * clusters[i].scatter_matrix().cast<double>() * R.transpose()).norm(), 1e-12) << i;
    EXPECT_LT((groups[i].noise - test::point_noise(T_WI.R * (mean - p_IL), {})).norm(), 1e-15) << i;
    EXPECT_EQ(groups[i].count, static_cast<double>(clusters[i].count)) << i;
  }
}

}  // namespace point_to_plane_test
}  // namespace kilvo
