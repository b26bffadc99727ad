#include "lab/simulation/simulator.hpp"

#include <algorithm>
#include <cstring>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>

namespace kilvo::lab {
namespace {

const Scenario& scenario(const std::string& name) { return *std::ranges::find(scenarios(), name, &Scenario::name); }

SimulatorConfig only(std::initializer_list<Sensor> sensors, double duration) {
  SimulatorConfig config;
  config.use.fill(false);
  for (const Sensor s : sensors) config.use[static_cast<std::size_t>(s)] = true;
  config.duration = duration;
  return config;
}

/// Small images, few points: quick.
SimulatorConfig small(double duration) {
  SimulatorConfig config;
  config.duration = duration;
  config.lidar.points = 1000;
  config.camera.width = 80;
  config.camera.height = 60;
  return config;
}

std::vector<Measurement> all_of(Simulator& simulator) {
  std::vector<Measurement> out;
  while (auto m = simulator.next()) out.push_back(*std::move(m));
  return out;
}

std::vector<std::uint8_t> bytes_of(const SimulatorConfig& config) {
  Simulator simulator(scenario("room"), config);
  std::vector<std::uint8_t> out;
  const auto add = [&](const void* from, std::size_t n) {
    const auto* p = static_cast<const std::uint8_t*>(from);
    out.insert(out.end(), p, p + n);
  };
  for (const Measurement& m : all_of(simulator)) {
    const Time t = stamp_of(m);
    add(&t, sizeof t);
    if (const auto* imu = std::get_if<ImuSample>(&m)) add(imu->gyro.data(), 24), add(imu->accel.data(), 24);
    if (const auto* joints = std::get_if<JointSample>(&m)) add(joints->position.data(), 8 * joints->position.size());
    if (const auto* scan = std::get_if<LidarScan>(&m)) add(scan->points.data(), sizeof(LidarPoint) * scan->points.size());
    if (const auto* camera = std::get_if<CameraImage>(&m)) add(camera->image.pixels.data(), camera->image.pixels.size());
  }
  return out;
}

TEST(Simulator, TheSameSeedGivesTheSameBytesWithAnyNumberOfThreads) {
  SimulatorConfig config = small(0.6);
  const auto first = bytes_of(config);
  EXPECT_GT(first.size(), 100'000U);
  EXPECT_TRUE(first == bytes_of(config));
  config.threads = 2;
  EXPECT_TRUE(first == bytes_of(config));
  config.seed = 2;
  EXPECT_FALSE(first == bytes_of(config));
}

TEST(Simulator, SensorsComeAtTheirRatesInTheOrderOfArrival) {
  Simulator simulator(scenario("room"), small(1));
  std::map<Sensor, int> counts;
  Time last{};
  while (const auto m = simulator.next()) {
    ++counts[sensor_of(*m)];
    EXPECT_GE(simulator.arrived(), last);
    EXPECT_GE(simulator.arrived(), stamp_of(*m));
    last = simulator.arrived();
  }
  EXPECT_EQ(counts[Sensor::imu], 201);
  EXPECT_EQ(counts[Sensor::legs], 1001);
  EXPECT_EQ(counts[Sensor::lidar], 10);
  EXPECT_EQ(counts[Sensor::camera], 11);
}

TEST(Simulator, ClocksMayBeOffAndStampsMayJitter) {
  SimulatorConfig config = only({Sensor::imu}, 2);
  config.imu.delivery.offset = 0.05;
  config.imu.delivery.jitter = 0.0005;
  Simulator simulator(scenario("stand"), config);
  double sum = 0, squares = 0;
  int n = 0;
  while (const auto m = simulator.next()) {
    const double late = to_seconds(stamp_of(*m) - simulator.measured()) - 0.05;
    sum += late;
    squares += late * late;
    ++n;
  }
  EXPECT_NEAR(sum / n, 0, 1e-4);
  EXPECT_NEAR(std::sqrt(squares / n), 0.0005, 1e-4);
}

TEST(Simulator, TheImuSaysTheTruthAndItsBiasAndItsNoise) {
  SimulatorConfig config = only({Sensor::imu}, 8);
  Simulator simulator(scenario("room"), config);
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = gyro;
  int n = 0;
  while (const auto m = simulator.next()) {
    const auto& s = std::get<ImuSample>(*m);
    const ImuTruth& truth = simulator.imu_truth();
    gyro += (s.gyro - truth.gyro - truth.gyro_bias).cwiseAbs2();
    accel += (s.accel - truth.accel - truth.accel_bias).cwiseAbs2();
    ++n;
    const bool standing = to_seconds(s.t - simulator.start()) < 2.9;
    EXPECT_TRUE(!standing || std::abs(truth.accel.norm() - 9.80665) < 1e-6) << truth.accel.norm();
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(gyro[i] / n), config.imu.gyro_noise * std::sqrt(200.0), 0.15e-3);
    EXPECT_NEAR(std::sqrt(accel[i] / n), config.imu.accel_noise * std::sqrt(200.0), 1.1e-3);
  }
}

TEST(Simulator, TheImuSaturates) {
  SimulatorConfig config = only({Sensor::imu}, 1);
  config.imu.accel_range = 5;
  Simulator simulator(scenario("stand"), config);
  for (const Measurement& m : all_of(simulator)) EXPECT_EQ(std::get<ImuSample>(m).accel.z(), -5) << "hangs upside down";
}

TEST(Simulator, EncodersAreQuantisedOffsetAndNoisy) {
  SimulatorConfig config = only({Sensor::legs}, 0.5);
  config.joints.position_noise = 0;
  config.joints.resolution = 1e-3;
  Simulator simulator(scenario("stand"), config);
  const auto samples = all_of(simulator);
  const auto& first = std::get<JointSample>(samples.front());
  ASSERT_EQ(first.names.size(), 13U);
  EXPECT_EQ(first.names[3], "left_knee_joint");
  const JointAngles truth = simulator.walk().joints(0);
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(first.position[i] / 1e-3, std::round(first.position[i] / 1e-3), 1e-6);
    worst = std::max(worst, std::abs(first.position[i] - truth[i]));
  }
  EXPECT_GT(worst, 3e-4);
  EXPECT_LT(worst, 3e-3);
}

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
    EXPECT_LT(std::abs(mean_distance(name, config, 4)), 1e-3) << name;
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

TEST(Camera, ProjectionAndItsInverseAgree) {
  const CameraModel model;
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(639, 10), Eigen::Vector2d(320, 240), Eigen::Vector2d(100, 479)}) {
    EXPECT_LT((project(model, unproject(model, pixel)) - pixel).norm(), 1e-6);
  }
}

float bilinear(const Image& image, const Eigen::Vector2d& p) {
  const int x = static_cast<int>(p.x()), y = static_cast<int>(p.y());
  const auto at = [&](int i, int j) {
    return static_cast<float>(
        image.pixels[3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(i)) + 1]);
  };
  const auto fx = static_cast<float>(p.x() - x), fy = static_cast<float>(p.y() - y);
  return (1 - fy) * ((1 - fx) * at(x, y) + fx * at(x + 1, y)) + fy * ((1 - fx) * at(x, y + 1) + fx * at(x + 1, y + 1));
}

// Correlation of a patch of the first image with where the same points of the world are in the second; nothing when it is not one plane
// seen by both, or is too flat in grey.
struct PatchView {
  const Simulator& simulator;
  const Image &first, &second;
  SE3 T_WC1, T_WC2;

  std::optional<double> correlation(int u0, int v0) const {
    constexpr int half = 5;
    const CameraModel& m = simulator.config().camera;
    std::vector<double> a, b;
    std::optional<std::size_t> surface;
    for (int v = v0 - half; v <= v0 + half; ++v) {
      for (int u = u0 - half; u <= u0 + half; ++u) {
        const Eigen::Vector3d direction = T_WC1.R * unproject(m, {u, v});
        const auto hit = simulator.world().cast(T_WC1.p, direction);
        if (!hit || surface.value_or(hit->surface) != hit->surface || hit->cosine < 0.3) return std::nullopt;
        surface = hit->surface;
        const Eigen::Vector3d p_W = T_WC1.p + hit->range * direction, p_C = T_WC2.inverse() * p_W;
        if (p_C.z() < 0.1) return std::nullopt;
        const Eigen::Vector2d x = project(m, p_C);
        if (x.x() < 2 || x.y() < 2 || x.x() > m.width - 4 || x.y() > m.height - 4) return std::nullopt;
        const auto back = simulator.world().cast(T_WC2.p, (p_W - T_WC2.p).normalized());
        if (!back || back->surface != hit->surface) return std::nullopt;
        a.push_back(bilinear(first, {u, v}));
        b.push_back(bilinear(second, x));
      }
    }
    if (std::ranges::max(a) > 253 || std::ranges::max(b) > 253) return std::nullopt;  // overexposed
    const Eigen::Map<Eigen::ArrayXd> x(a.data(), static_cast<Eigen::Index>(a.size())), y(b.data(), static_cast<Eigen::Index>(b.size()));
    const Eigen::ArrayXd dx = x - x.mean(), dy = y - y.mean();
    if (std::sqrt(dx.square().mean()) < 10) return std::nullopt;
    return (dx * dy).sum() / std::sqrt(dx.square().sum() * dy.square().sum());
  }
};

TEST(Camera, TheSamePointLooksTheSameHalfASecondLater) {
  for (const char* name : {"room", "corridor", "stairs", "yard"}) {
    SimulatorConfig config = only({Sensor::camera}, 5);
    config.camera.read_noise = config.camera.photon_noise = 0;
    config.threads = 2;
    config.camera.delivery.rate = 2;
    Simulator simulator(scenario(name), config);
    const auto images = all_of(simulator);
    const auto pose = [&](double t) { return simulator.walk().torso(t) * config.camera.T_torso_camera; };
    const PatchView view{simulator, std::get<CameraImage>(images[9]).image, std::get<CameraImage>(images[10]).image, pose(4.5), pose(5)};
    std::vector<double> all;
    for (int v = 20; v < 460; v += 14) {
      for (int u = 20; u < 620; u += 14) {
        if (const auto c = view.correlation(u, v)) all.push_back(*c);
      }
    }
    std::ranges::sort(all);
    EXPECT_GT(all.size(), 25U) << name;
    EXPECT_GT(all[all.size() / 20], 0.99) << name;
  }
}

TEST(Camera, ItsExposureChanges) {
  SimulatorConfig config = small(2);
  config.use = {false, false, false, true};
  config.camera.delivery.rate = 1;
  config.camera.read_noise = config.camera.photon_noise = 0;
  Simulator simulator(scenario("stand"), config);
  const auto images = all_of(simulator);
  const auto& model = config.camera;
  const Image &a = std::get<CameraImage>(images[0]).image, &b = std::get<CameraImage>(images[1]).image;
  const double gain = exposure_at(model, 1) / exposure_at(model, 0);
  EXPECT_GT(gain, 1.1);
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (a.pixels[i] < 20 || b.pixels[i] > 250) continue;
    EXPECT_NEAR(b.pixels[i], gain * a.pixels[i], 1.3);
  }
}

TEST(Camera, MotionBlurSmearsWhatAMovingCameraSees) {
  const auto sharpness = [](int blur_samples) {
    SimulatorConfig config = small(0);
    config.camera.blur_samples = blur_samples;
    config.camera.exposure = 0.03;
    config.camera.gain = 40;
    config.camera.read_noise = config.camera.photon_noise = 0;
    const World world(make_scene("room", 1), 1);
    const CameraSensor camera(config, world);
    // Turns at 2 rad/s.
    const Image image = camera.image(
        0, 1,
        [](double t) {
          return SE3{SO3::Exp({0, 0, 2 * t}), {0, 0, 0.8}};
        },
        Workers());
    double sum = 0;
    for (std::size_t i = 3; i < image.pixels.size(); ++i) sum += std::abs(image.pixels[i] - image.pixels[i - 3]);
    return sum / static_cast<double>(image.pixels.size());
  };
  EXPECT_LT(sharpness(8), 0.8 * sharpness(1));
}

// How near anything comes to the middle of the pelvis and of the torso, sideways.
double nearest_wall(const World& world, const Walk& walk) {
  double nearest = 99;
  for (double t = 0; t < walk.end(); t += 0.4) {
    for (const Eigen::Vector3d& p : {walk.pelvis(t).p, Eigen::Vector3d(walk.torso(t) * Eigen::Vector3d(0, 0, 0.2))}) {
      for (double angle = 0; angle < 6.28; angle += 0.2) {
        if (const auto hit = world.cast(p, {std::cos(angle), std::sin(angle), 0})) nearest = std::min(nearest, hit->range);
      }
    }
  }
  return nearest;
}

TEST(World, NobodyWalksThroughFurniture) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    std::map<std::string, std::unique_ptr<World>> worlds;
    for (const Scenario& s : scenarios()) {
      auto& made = worlds[s.world];
      if (!made) made = std::make_unique<World>(make_scene(s.world, seed), seed);
      const World& world = *made;
      EXPECT_GT(nearest_wall(world, Walk(BipedShape{}, world.ground(), s.start, s.stages)), 0.4) << s.name << " with seed " << seed;
    }
  }
}

TEST(World, AnUnknownNameIsRefused) { EXPECT_THROW(make_scene("moon", 1), std::invalid_argument); }

}  // namespace
}  // namespace kilvo::lab
