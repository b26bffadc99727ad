#include "lab/simulation/lidar_sensor.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <map>

#include "tests/helpers/simulated.hpp"

namespace kilvo::lab {
namespace lidar_sensor_test {

using test::all_of;
using test::only;
using test::scenario;

// Mean distance of the points, put into the world by the truth, from their nearest surface (the plane through it).
double mean_distance(const std::string& name, const SimulatorConfig& config, double after) {
  Simulator simulator(scenario(name), config);
  double sum = 0, n = 0;
  while (const auto m = simulator.next()) {
    const auto& scan = std::get<LidarScan>(*m);
    if (to_seconds(scan.t - simulator.start()) < after) continue;
    for (const LidarPoint& p : scan.points) {
      const double t = simulator.seconds_of(scan.t) + 1e-9 * p.offset_ns;
      const SE3 T_WL = simulator.walk().torso(t) * config.shape.T_torso_lidar;
      const Eigen::Vector3d p_L(p.x, p.y, p.z), direction = T_WL.R * p_L.normalized();
      const auto hit = simulator.world().cast(T_WL.p, direction);
      if (!hit || std::abs(hit->range - p_L.norm()) > 0.2) continue;  // noise of the angle moved it over an edge
      const Surface& s = simulator.world().surfaces()[hit->surface];
      sum += s.normal().dot(T_WL * p_L - s.corner) * (s.normal().dot(direction) > 0 ? 1 : -1);
      ++n;
    }
  }
  EXPECT_GT(n, 3000);
  return sum / n;
}

TEST(Lidar, PointsLieOnTheirSurfaces) {
  for (const char* name : {"room", "yard", "stairs"}) {
    SimulatorConfig config = only({Sensor::lidar}, 5);
    config.lidar.points = 3000;
    const double noisy = std::abs(mean_distance(name, config, 4));
    RecordProperty(name, std::to_string(1e3 * noisy) + " mm");
    EXPECT_LT(noisy, 1e-3) << name;
    config.lidar.range_noise = config.lidar.angle_noise = 0;
    EXPECT_LT(std::abs(mean_distance(name, config, 4)), 1e-6) << name;
  }
}

TEST(Lidar, TheRosetteDoesNotRepeatAndTheLinesDo) {
  LidarModel model;
  const auto nearest = [&](int i, double later) {
    double best = 9;
    for (int k = 0; k < model.points; ++k) {
      best = std::min(best, (ray_direction(model, k, later + 5e-6 * k, 0) - ray_direction(model, i, 5e-6 * i, 0)).norm());
    }
    return best;
  };
  double rosette = 0;
  for (int i = 0; i < 20; ++i) rosette += nearest(997 * i, 0.1) / 20;
  EXPECT_GT(rosette, 1e-3);
  model.scan = LidarModel::Scan::lines_16;
  EXPECT_LT(nearest(4711, 0.1), 1e-9);
}

TEST(Lidar, ASpinningOneGivesItsLines) {
  SimulatorConfig config = only({Sensor::lidar}, 0.1);
  config.lidar.scan = LidarModel::Scan::lines_64;
  Simulator simulator(scenario("room"), config);
  const auto scans = all_of(simulator);
  ASSERT_EQ(scans.size(), 1U);
  std::map<int, int> lines;  // by elevation in steps of a line
  int late = -1;
  for (const LidarPoint& p : std::get<LidarScan>(scans[0]).points) {
    const double elevation = std::atan2(p.z, std::hypot(p.x, p.y)) * 180 / 3.14159265;
    ++lines[static_cast<int>(std::lround((elevation + 22.5) / 45 * 63))];
    EXPECT_GT(p.offset_ns, late);
    late = p.offset_ns;
  }
  EXPECT_GE(lines.size(), 60U);
  EXPECT_LE(lines.size(), 66U);
}

TEST(Lidar, TheOwnBodyIsNotSeenAndFarAndGrazedSurfacesAreNot) {
  SimulatorConfig config = only({Sensor::lidar}, 0.2);
  Simulator simulator(scenario("room"), config);
  const auto scans = all_of(simulator);
  const auto& scan = std::get<LidarScan>(scans.front());
  EXPECT_LT(scan.points.size(), 20'000U);
  EXPECT_GT(scan.points.size(), 15'000U);
  for (const LidarPoint& p : scan.points) {
    const Eigen::Vector3d d = config.shape.T_torso_lidar.R * Eigen::Vector3d(p.x, p.y, p.z).normalized();
    // The arms hang 0.2 m to the sides: straight down and aside nothing can be seen.
    ASSERT_FALSE(std::abs(d.x()) < 0.03 && std::abs(d.y()) > 0.7 && std::abs(d.y()) < 0.75 && d.z() < 0) << d.transpose();
    ASSERT_LT(p.offset_ns, 100'000'000);
  }
  config.lidar.max_range = 2;
  Simulator near(scenario("room"), config);
  const auto near_scans = all_of(near);
  for (const LidarPoint& p : std::get<LidarScan>(near_scans.front()).points) ASSERT_LT(Eigen::Vector3f(p.x, p.y, p.z).norm(), 2.15F);
}

TEST(Lidar, TheMiddleOfTheCorridorSaysNothingAboutTheWayAlongIt) {
  const Scenario& corridor = scenario("corridor");
  const World world(make_scene("corridor", 1), 1);
  SimulatorConfig config;
  config.lidar.points = 2000;
  const LidarSensor lidar(config, world, corridor.lidar_range);
  const auto along = [&](double x) {
    SE3 T_WT;
    T_WT.p = {x, 0, 0.8};
    double sum = 0, n = 0;
    for (const LidarPoint& p : lidar
                                   .scan(
                                       0, 0, [&](double) { return T_WT; }, Workers())
                                   .points) {
      const Eigen::Vector3d direction = config.shape.T_torso_lidar.R * Eigen::Vector3d(p.x, p.y, p.z).normalized();
      const auto hit = world.cast(T_WT * config.shape.T_torso_lidar.p, direction);
      if (hit) sum += std::pow(world.surfaces()[hit->surface].normal().x(), 2), ++n;
    }
    EXPECT_GT(n, 1000);
    return sum / n;
  };
  EXPECT_GT(along(0), 0.03);
  EXPECT_GT(along(33), 0.03);
  EXPECT_EQ(along(18), 0);
}

}  // namespace lidar_sensor_test
}  // namespace kilvo::lab
