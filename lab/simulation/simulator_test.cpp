#include "lab/simulation/simulator.hpp"

#include <gtest/gtest.h>
#include <map>

#include "tests/helpers/simulated.hpp"

namespace kilvo::lab {
namespace simulator_test {

using test::all_of;
using test::only;
using test::scenario;
using test::small;

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

}  // namespace simulator_test
}  // namespace kilvo::lab
