// What happens to a sweep of 20 000 points in the analytic room: undistortion, downsampling, registration, insertion.
#include <benchmark/benchmark.h>
#include <vector>

#include "kilvo/filter/update.hpp"
#include "kilvo/lidar/downsample.hpp"
#include "kilvo/lidar/point_to_plane.hpp"
#include "kilvo/lidar/undistort.hpp"
#include "kilvo/map/voxel_map.hpp"
#include "lab/simulation/analytic_room.hpp"

namespace kilvo {
namespace {

constexpr std::size_t sweeps = 40;
constexpr std::size_t known = sweeps - 1;  // the last one is registered against the map of those before

struct Sweep {
  LidarScan scan;
  Time centre;
  SE3 T_WI;  // true, at the centre
  std::vector<PointCluster> clusters;
  std::vector<PointGroup> groups;
};

// Sweeps of the room with the truth for a trajectory.
class Scene {
 public:
  Scene() : room_(lab::AnalyticRoomConfig{}), trajectory_(std::chrono::hours(1)) {
    mount_.T_imu_lidar = lab::AnalyticRoomConfig{}.T_imu_lidar;
    while (sweeps_.size() < sweeps) {
      const auto m = room_.next();
      if (const auto* imu = std::get_if<ImuSample>(&*m)) trajectory_.push(imu->t, room_.truth(imu->t), room_.velocity(imu->t));
      if (const auto* scan = std::get_if<LidarScan>(&*m); scan != nullptr && !scan->points.empty()) add(*scan);
    }
    for (std::size_t i = 0; i < known; ++i) map_.insert(sweeps_[i].groups, 0);
  }

  const Sweep& sweep(std::size_t i) const { return sweeps_[i]; }
  const Sweep& last() const { return sweeps_.back(); }
  const VoxelMap& map() const { return map_; }
  const LidarConfig& config() const { return config_; }
  const Eigen::Vector3d& p_IL() const { return mount_.T_imu_lidar.p; }

  std::vector<PointXYZI> undistorted(const Sweep& s) const {
    PointDrops drops;
    return undistort(s.scan, trajectory_, s.centre, mount_, drops);
  }

  // A centimetre and a third of a degree away from the truth.
  Estimate prior() const {
    Estimate e;
    e.t = last().centre;
    e.x.R = last().T_WI.R * SO3::Exp({0.004, -0.003, 0.003});
    e.x.p = last().T_WI.p + Eigen::Vector3d(0.006, -0.006, 0.004);
    e.P.setIdentity();
    e.P *= 1e-4;
    return e;
  }

 private:
  void add(const LidarScan& scan) {
    Sweep s;
    s.scan = scan;
    s.centre = scan.t + std::chrono::milliseconds(50);
    s.T_WI = room_.truth(s.centre);
    s.clusters = downsample(undistorted(s), s.T_WI, config_.voxel_size);
    s.groups = to_world(s.clusters, s.T_WI, p_IL(), config_);
    sweeps_.push_back(std::move(s));
  }

  lab::AnalyticRoom room_;
  Trajectory trajectory_;
  LidarMount mount_;
  LidarConfig config_;
  std::vector<Sweep> sweeps_;
  VoxelMap map_{MapConfig{}};
};

const Scene& scene() {
  static const Scene made;
  return made;
}

void undistort_20k(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) {
    auto points = s.undistorted(s.last());
    benchmark::DoNotOptimize(points);
  }
}
BENCHMARK(undistort_20k);

void downsample_20k(benchmark::State& state) {
  const Scene& s = scene();
  const auto points = s.undistorted(s.last());
  for (auto _ : state) {
    auto clusters = downsample(points, s.last().T_WI, s.config().voxel_size);
    benchmark::DoNotOptimize(clusters);
  }
}
BENCHMARK(downsample_20k);

void registration_one_evaluation(benchmark::State& state) {
  const Scene& s = scene();
  const Workers one;
  const Estimate prior = s.prior();
  LidarModel model(s.map(), s.last().clusters, s.p_IL(), PoseCovariance::Zero(), s.config(), one);
  for (auto _ : state) {
    auto info = model(prior.x, prior.P);
    benchmark::DoNotOptimize(info);
  }
}
BENCHMARK(registration_one_evaluation);

void registration_whole_update(benchmark::State& state) {
  const Scene& s = scene();
  const Workers one;
  const Estimate prior = s.prior();
  for (auto _ : state) {
    LidarModel model(s.map(), s.last().clusters, s.p_IL(), PoseCovariance::Zero(), s.config(), one);
    auto posterior = update(prior, model, UpdateConfig{});
    benchmark::DoNotOptimize(posterior);
  }
}
BENCHMARK(registration_whole_update);

void clusters_to_world(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) {
    auto groups = to_world(s.last().clusters, s.last().T_WI, s.p_IL(), s.config());
    benchmark::DoNotOptimize(groups);
  }
}
BENCHMARK(clusters_to_world);

// One sweep after the other into a map that begins empty: the mean of the first 40.
void insert_into_new_map(benchmark::State& state) {
  const Scene& s = scene();
  auto map = std::make_unique<VoxelMap>(MapConfig{});
  std::size_t i = 0;
  for (auto _ : state) {
    map->insert(s.sweep(i++ % sweeps).groups, 0);
    if (i % sweeps != 0) continue;
    state.PauseTiming();
    map = std::make_unique<VoxelMap>(MapConfig{});
    state.ResumeTiming();
  }
}
BENCHMARK(insert_into_new_map)->Iterations(sweeps);

// The same sweeps into a map that has seen them often.
void insert_into_known_map(benchmark::State& state) {
  const Scene& s = scene();
  static VoxelMap map{MapConfig{}};
  std::size_t i = 0;
  for (; map.empty() || i < 5 * sweeps; ++i) map.insert(s.sweep(i % sweeps).groups, 0);
  for (auto _ : state) map.insert(s.sweep(i++ % sweeps).groups, 0);
}
BENCHMARK(insert_into_known_map)->Iterations(sweeps);

}  // namespace
}  // namespace kilvo
