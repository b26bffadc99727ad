// Is the error as large as the covariance says? NEES of rotation and of position (3 degrees of freedom each), over many seeds.
#include <Eigen/Cholesky>
#include <algorithm>
#include <deque>
#include <gtest/gtest.h>
#include <span>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/filter/update.hpp"
#include "kilvo/lidar/undistort.hpp"
#include "lab/simulation/analytic_room.hpp"
#include "tests/helpers/exact_map.hpp"
#include "tests/helpers/predict.hpp"

namespace kilvo {
namespace consistency_test {

using Path = lab::AnalyticRoomConfig::Path;

// Without optimisation, or with sanitizers, only a taste of it: the bands widen by themselves.
#ifdef NDEBUG
constexpr std::uint64_t strict_seeds = 50, seeds = 10;
#else
constexpr std::uint64_t strict_seeds = 2, seeds = 1;
#endif

// Of one seed at one sweep.
struct Nees {
  double rotation = 0, position = 0, pose = 0;
};

Nees nees_of(const SE3& estimate, const SE3& truth, const PoseCovariance& P) {
  Eigen::Matrix<double, 6, 1> e;
  e << (estimate.R.inverse() * truth.R).Log(), truth.p - estimate.p;
  const Eigen::Vector3d r = e.head<3>(), p = e.tail<3>();
  return {r.dot(P.topLeftCorner<3, 3>().ldlt().solve(r)), p.dot(P.bottomRightCorner<3, 3>().ldlt().solve(p)), e.dot(P.ldlt().solve(e))};
}

// The loop of Estimator::process with a given map: nothing is inserted, and the start is known.
class GivenMapOdometry {
 public:
  GivenMapOdometry(const VoxelMap& map, const lab::AnalyticRoomConfig& room, const Estimate& start) : map_(map), anchor_(start) {
    noise_ = {room.gyro_noise, room.accel_noise, 0, 0, 0, 0, 0};
    mount_.T_imu_lidar = room.T_imu_lidar;
    lidar_.range_noise = room.range_noise;
    lidar_.angle_noise = room.angle_noise;
    trajectory_.push(start.t, start.x.pose(), start.x.v);
  }

  void add(const ImuSample& s) { imu_.push_back(s); }
  Time newest() const { return imu_.empty() ? anchor_.t : imu_.back().t; }

  /// The estimate at the middle of the scan.
  const Estimate& process(const LidarScan& scan, Time end) {
    const Time centre = end - (end - begin_of(scan)) / 2;
    const Estimate prior = propagate(anchor_, centre);
    propagate(prior, end);
    PointDrops drops;
    const auto points = undistort(scan, trajectory_, centre, mount_, drops);
    const auto clusters = downsample(points, prior.x.pose(), lidar_.voxel_size, lidar_.reach());
    LidarModel model(map_, clusters, mount_.T_imu_lidar.p, PoseCovariance::Zero(), lidar_, workers_);
    const UndistortionNoise within_scan = undistortion_noise(noise_, end - centre);
    const auto measured = [&](const State& x, const Covariance& P) {
      Information<6> info = model(x, P);
      add_common_noise(within_scan.V, info);
      return info;
    };
    anchor_ = update(prior, measured, {}, &within_scan.with_prediction).posterior;
    trajectory_.correct(centre, anchor_.x.pose(), anchor_.x.v - prior.x.v);
    while (imu_.size() > 2 && imu_[1].t <= anchor_.t) imu_.pop_front();
    return anchor_;
  }

 private:
  Estimate propagate(Estimate e, Time until) {
    for (std::size_t i = 1; i < imu_.size() && e.t < until; ++i) {
      if (imu_[i].t <= e.t) continue;
      e = test::predict(e, ImuInterval::between(imu_[i - 1], imu_[i], e.t, std::min(until, imu_[i].t)), {}, noise_);
      trajectory_.push(e.t, e.x.pose(), e.x.v);
    }
    return e;
  }

  const VoxelMap& map_;
  Estimate anchor_;
  std::deque<ImuSample> imu_;
  Trajectory trajectory_{std::chrono::milliseconds(500)};
  ProcessNoise noise_;
  LidarConfig lidar_;
  LidarMount mount_;
  Workers workers_;
};

Estimate known_start(const lab::AnalyticRoom& room, const lab::AnalyticRoomConfig& config) {
  Estimate e;
  e.t = room.start();
  e.x.R = room.truth(e.t).R;
  e.x.p = room.truth(e.t).p;
  e.x.v = room.velocity(e.t);
  e.x.bg = config.gyro_bias;
  e.x.ba = config.accel_bias;
  e.P.diagonal().head<9>().setConstant(1e-12);
  return e;
}

std::vector<Nees> run_with_given_map(const VoxelMap& map, const lab::AnalyticRoomConfig& config) {
  lab::AnalyticRoom room(config);
  GivenMapOdometry odometry(map, config, known_start(room, config));
  std::vector<Nees> out;
  std::optional<LidarScan> pending;
  while (auto m = room.next()) {
    if (auto* scan = std::get_if<LidarScan>(&*m)) {
      pending = std::move(*scan);
    } else {
      odometry.add(std::get<ImuSample>(*m));
    }
    if (!pending || odometry.newest() < completion_of(*pending)) continue;
    const Estimate& e = odometry.process(*pending, completion_of(*pending));
    out.push_back(nees_of(e.x.pose(), room.truth(e.t), e.P.topLeftCorner<6, 6>()));
    pending.reset();
  }
  return out;
}

struct Share {
  double inside = 0, mean = 0;
};

// Of the sweeps from `first` on: how many have the mean over all runs within [low, high], and the mean of all.
Share share_within(const std::vector<std::vector<Nees>>& runs, double Nees::*part, std::size_t first, double low, double high) {
  std::size_t sweeps = runs.front().size();
  for (const auto& run : runs) sweeps = std::min(sweeps, run.size());
  Share out;
  for (std::size_t k = first; k < sweeps; ++k) {
    double mean = 0;
    for (const auto& run : runs) mean += run[k].*part / static_cast<double>(runs.size());
    out.inside += mean >= low && mean <= high ? 1 : 0;
    out.mean += mean;
  }
  out.inside /= static_cast<double>(sweeps - first);
  out.mean /= static_cast<double>(sweeps - first);
  return out;
}

void expect_consistent_with_given_map(Path path) {
  lab::AnalyticRoomConfig config;
  config.path = path;
  config.still = -2;  // in full motion from the start
  config.duration = 8.05;
  config.points_per_scan = 3000;
  const VoxelMap map = test::exact_map(lab::AnalyticRoom(config).surfaces(), SE3{});
  std::vector<std::vector<Nees>> runs;
  for (std::uint64_t seed = 1; seed <= strict_seeds; ++seed) {
    config.seed = seed;
    runs.push_back(run_with_given_map(map, config));
    ASSERT_GE(runs.back().size(), 79U);
  }
  // 95 % of the mean of chi-square values lie within these (Wilson and Hilferty): for 50 with 3 degrees of freedom [2.36, 3.72].
  const double spread = 2.0 / (9 * 3.0 * static_cast<double>(strict_seeds));
  const double low = 3 * std::pow(1 - spread - 1.96 * std::sqrt(spread), 3), high = 3 * std::pow(1 - spread + 1.96 * std::sqrt(spread), 3);
  for (const auto part : {&Nees::rotation, &Nees::position}) {
    const Share share = share_within(runs, part, 10, low, high);
    testing::Test::RecordProperty(part == &Nees::rotation ? "rotation" : "position", std::to_string(share.mean));
    EXPECT_GE(share.inside, 0.85) << (part == &Nees::rotation ? "rotation" : "position") << ", mean NEES " << share.mean;
  }
}

TEST(Consistency, WithAGivenMapTheErrorIsWhatTheCovarianceSaysOnAStraightPath) { expect_consistent_with_given_map(Path::straight); }

TEST(Consistency, WithAGivenMapTheErrorIsWhatTheCovarianceSaysOnALoop) { expect_consistent_with_given_map(Path::loop); }

// The estimator as it is, with the map that it builds.
std::vector<Nees> run_with_own_map(const lab::AnalyticRoomConfig& config) {
  lab::AnalyticRoom room(config);
  Robot robot;
  robot.lidar.T_imu_lidar = config.T_imu_lidar;
  EstimatorConfig config_of_exact_mount;
  config_of_exact_mount.lidar.mount_error = false;
  Estimator estimator(robot, config_of_exact_mount, {true, false, true, false});
  std::optional<SE3> T_WR;  // the room in the estimator's world, by the first pose
  std::vector<Nees> out;
  const auto take = [&](const std::vector<Output>& outputs) {
    for (const Output& o : outputs) {
      if (!T_WR) T_WR = o.x.pose() * room.truth(o.t).inverse();
      if (o.is_sweep) out.push_back(nees_of(o.x.pose(), *T_WR * room.truth(o.t), o.P.topLeftCorner<6, 6>()));
    }
  };
  while (auto m = room.next()) take(estimator.push(std::move(*m)));
  take(estimator.finish());
  return out;
}

void expect_consistent_with_own_map(Path path) {
  lab::AnalyticRoomConfig config;
  config.path = path;
  config.duration = 12;
  config.points_per_scan = 5000;
  std::vector<std::vector<Nees>> runs;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    config.seed = seed;
    runs.push_back(run_with_own_map(config));
    ASSERT_GE(runs.back().size(), 110U);
  }
  const Share share = share_within(runs, &Nees::pose, 0, 0.4 * 6, 2.0 * 6);
  testing::Test::RecordProperty("pose", std::to_string(share.mean / 6));
  EXPECT_GT(share.mean / 6, 0.2);
  EXPECT_LT(share.mean / 6, 3.0);
  // Of few runs the mean at one time is a matter of luck.
  if (seeds >= 10) {
    EXPECT_GE(share.inside, 0.9) << "mean NEES per degree of freedom " << share.mean / 6;
  }
}

TEST(Consistency, WithItsOwnMapTheErrorIsAsLargeAsTheCovarianceSaysOnAStraightPath) { expect_consistent_with_own_map(Path::straight); }

TEST(Consistency, WithItsOwnMapTheErrorIsAsLargeAsTheCovarianceSaysOnALoop) { expect_consistent_with_own_map(Path::loop); }

}  // namespace consistency_test
}  // namespace kilvo
