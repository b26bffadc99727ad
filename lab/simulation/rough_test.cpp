#include "lab/simulation/rough.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/simulation/clutter.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/rough_record.hpp"
#include "lab/simulation/units.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo::lab {
namespace rough_test {

using test::all_of;
using test::only;
using test::scenario;
using test::small;
using testing::HasSubstr;
using testing::Not;

std::vector<double> numbers_of(const SimulatorConfig& config, const std::string& name = "room") {
  Simulator simulator(scenario(name), config);
  std::vector<double> out;
  for (const Measurement& m : all_of(simulator)) {
    out.push_back(to_seconds(stamp_of(m) - simulator.start()));
    if (const auto* imu = std::get_if<ImuSample>(&m)) out.insert(out.end(), {imu->gyro.x(), imu->accel.x(), imu->accel.z()});
    if (const auto* joints = std::get_if<JointSample>(&m)) out.insert(out.end(), joints->position.begin(), joints->position.end());
    if (const auto* scan = std::get_if<LidarScan>(&m)) {
      for (const LidarPoint& p : scan->points) out.insert(out.end(), {p.x, p.y, p.z});
    }
    if (const auto* camera = std::get_if<CameraImage>(&m)) {
      for (const std::uint8_t pixel : camera->image.pixels) out.push_back(pixel);
    }
  }
  return out;
}

SimulatorConfig rough_one(SimulatorConfig nominal, int level, const std::string& parts) {
  return rough_robot(nominal, level, rough_parts(parts)).truth;
}

TEST(Rough, LevelZeroIsTheRobotAsItIsDescribed) {
  const RoughRobot robot = rough_robot(small(0.4), 0, {});
  EXPECT_EQ(numbers_of(robot.truth), numbers_of(small(0.4)));
  EXPECT_EQ(simulated_config(robot.known, "x"), simulated_config(robot.truth, "x"));
}

TEST(Rough, TheSameSeedGivesTheSameNumbersWithAnyNumberOfThreads) {
  SimulatorConfig config = rough_robot(small(0.4), 2, {}).truth;
  const auto first = numbers_of(config);
  config.threads = 2;
  EXPECT_EQ(first, numbers_of(config));
  SimulatorConfig other = small(0.4);
  other.seed = 2;
  EXPECT_NE(first, numbers_of(rough_robot(other, 2, {}).truth));
  EXPECT_NE(first, numbers_of(rough_robot(small(0.4), 1, {}).truth));
}

TEST(Rough, PartsAreChosenByName) {
  EXPECT_EQ(names_of(rough_parts("")), "lidar,scene,imu,legs,camera,mount,time");
  EXPECT_EQ(names_of(rough_parts("time,imu")), "imu,time");
  for (const char* wrong : {"people", "imu,lidra", ",", "imu,,legs"}) {
    EXPECT_THROW(rough_parts(wrong), std::invalid_argument) << wrong;
  }
  try {
    rough_parts("imu,people");
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "no part 'people'; there are lidar,scene,imu,legs,camera,mount,time");
  }
}

// A part alone is what it is among the others, and leaves the others ideal.
TEST(Rough, OnePartAloneIsTheSameAsAmongTheOthers) {
  const RoughRobot all = rough_robot({}, 2, {}), imu = rough_robot({}, 2, rough_parts("imu")),
                   mount = rough_robot({}, 2, rough_parts("mount"));
  EXPECT_EQ(all.truth.errors.imu->gyro, imu.truth.errors.imu->gyro);
  EXPECT_EQ(all.truth.errors.imu->accel_warming, imu.truth.errors.imu->accel_warming);
  EXPECT_FALSE(imu.truth.errors.lidar || imu.truth.errors.camera);
  EXPECT_EQ(imu.truth.wear.zero_offset, 0);
  EXPECT_EQ(all.truth.shape.T_imu_lidar.p, mount.truth.shape.T_imu_lidar.p);
  EXPECT_EQ(simulated_config(mount.known, "x"), simulated_config({}, "x"));
  EXPECT_FALSE(mount.truth.errors.imu);
}

TEST(RoughImu, ShowsItsAxesItsBiasAndThePullOfAccelerations) {
  SimulatorConfig config = rough_one(only({Sensor::imu}, 8), 1, "imu");
  config.imu.gyro_noise = config.imu.accel_noise = config.imu.gyro_bias_walk = config.imu.accel_bias_walk = 0;
  const ImuErrors& e = *config.errors.imu;
  for (int i = 0; i < 3; ++i) {
    for (const Eigen::Matrix3d& m : {e.gyro, e.accel}) {
      EXPECT_GE(std::abs(m(i, i) - 1), 0.001);
      EXPECT_LE(std::abs(m(i, i) - 1), 0.002);
      EXPECT_LE(std::abs(m(i, (i + 1) % 3)), 0.15 * degree);
    }
  }
  Simulator simulator(scenario("room"), config);
  Eigen::Vector3d first_bias = Eigen::Vector3d::Zero();
  double shaken2 = 0, n = 0;
  while (const auto m = simulator.next()) {
    const auto& s = std::get<ImuSample>(*m);
    const ImuTruth& truth = simulator.imu_truth();
    if (n++ == 0) first_bias = truth.accel_bias;
    ASSERT_LT((s.gyro - e.gyro * truth.gyro - e.g_sensitivity * truth.accel - truth.gyro_bias).norm(), 1e-12);
    ASSERT_LT((s.accel - e.accel * truth.accel - truth.accel_bias).norm(), 1e-12);
    const double t = simulator.seconds_of(s.t);
    const Eigen::Vector3d ideal =
        simulator.walk().imu(t).R.inverse() * (simulator.walk().acceleration(t) + Eigen::Vector3d(0, 0, Simulator::gravity));
    if (t > 4) shaken2 += (truth.accel - ideal).squaredNorm() / 3 / (200 * 4);
  }
  EXPECT_NEAR((simulator.imu_truth().accel_bias - first_bias).norm(), 0.015 * (1 - std::exp(-8.0 / 120)), 1e-9);
  EXPECT_NEAR(std::sqrt(shaken2), 0.3, 0.03);
}

TEST(RoughImu, IsClippedByImpactsWhenItWasLeftAtItsSmallestRange) {
  const auto most = [](int level) {
    double out = 0;
    Simulator simulator(scenario("run_room"), rough_one(only({Sensor::imu}, 9), level, "imu"));
    for (const Measurement& m : all_of(simulator)) out = std::max(out, std::get<ImuSample>(m).accel.cwiseAbs().maxCoeff());
    return out;
  };
  EXPECT_DOUBLE_EQ(most(2), 2 * 9.80665);
  EXPECT_GT(most(1), 2 * 9.80665);
}

TEST(RoughLidar, WeakEchoesAreLongerAndNoisier) {
  const LidarErrors e = *rough_robot({}, 2, {}).truth.errors.lidar;
  EXPECT_DOUBLE_EQ(e.sigma(1, 0), 0.020);
  EXPECT_NEAR(e.sigma(std::cos(75 * degree), 20), 0.040, 1e-4);
  for (std::size_t material = 0; material < 20; ++material) {
    EXPECT_NEAR(e.bias(std::cos(75 * degree), material) - e.bias(1, material), 0.020, 1e-4);
    EXPECT_LE(std::abs(e.bias(1, material)), 0.015);
  }
  EXPECT_NE(e.bias(1, 1), e.bias(1, 2));
}

/// Scans of a robot that stands, by the ray: rough and ideal ones of the same direction.
struct TwoScans {
  std::vector<LidarPoint> rough, ideal;

  explicit TwoScans(int level) {
    SimulatorConfig config = only({Sensor::lidar}, 0.5);
    config.lidar.angle_noise = config.lidar.range_noise = 0;
    rough = points_of(rough_one(config, level, "lidar"));
    ideal = points_of(config);
  }
  static std::vector<LidarPoint> points_of(const SimulatorConfig& config) {
    std::vector<LidarPoint> out(5 * static_cast<std::size_t>(config.lidar.points));
    Simulator simulator(scenario("room"), config);
    std::size_t scans = 0;
    for (const Measurement& m : all_of(simulator)) {
      for (const LidarPoint& p : std::get<LidarScan>(m).points) {
        const double ray = p.offset_ns * 1e-9 * config.lidar.delivery.rate * config.lidar.points;
        out[scans * static_cast<std::size_t>(config.lidar.points) + static_cast<std::size_t>(std::lround(ray))] = p;
      }
      ++scans;
    }
    return out;
  }
};

double range_of(const LidarPoint& p) { return std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z); }

TEST(RoughLidar, EchoesAreLostMixedOrFarOffAsOftenAsAsked) {
  const TwoScans scans(2);
  double seen = 0, lost = 0, arms = 0, outliers = 0, between = 0;
  for (std::size_t i = 0; i < scans.ideal.size(); ++i) {
    const double rough = range_of(scans.rough[i]), ideal = range_of(scans.ideal[i]);
    const bool arm = rough > 0 && rough < 0.75;
    arms += arm ? 1 : 0;
    if (ideal == 0 || arm) continue;
    ++seen;
    lost += rough == 0 ? 1 : 0;
    const double off = std::abs(rough - ideal);
    outliers += rough > 0 && off > 0.12 && off < 0.25 ? 1 : 0;
    between += rough > 0 && off > 0.25 ? 1 : 0;
  }
  EXPECT_NEAR(lost / seen, 0.08, 0.005);
  EXPECT_NEAR(arms / static_cast<double>(scans.ideal.size()), 0.02, 0.003);
  EXPECT_GT(outliers / seen, 0.003);  // 3 % with a sigma of 0.10 to 0.14: more than 0.12 off by a third of them
  EXPECT_LT(outliers / seen, 0.02);
  EXPECT_GT(between / seen, 0.0003);  // no Gaussian goes there: edges
  EXPECT_LT(between / seen, 0.01);
}

TEST(RoughLidar, RaysWithoutEchoAreInTheMessage) {
  SimulatorConfig config = rough_one(only({Sensor::lidar}, 0.1), 1, "lidar");
  Simulator simulator(scenario("yard"), config);
  const auto scans = all_of(simulator);
  const auto& points = std::get<LidarScan>(scans.front()).points;
  EXPECT_EQ(points.size(), 20000U);
  EXPECT_GT(std::ranges::count_if(points, [](const LidarPoint& p) { return p.x == 0 && p.y == 0 && p.z == 0; }), 400);
}

TEST(RoughCamera, LightIsTakenFromTheCornersAndDriftsAndGreyLevelsAreNotLinear) {
  const CameraErrors e = *rough_robot({}, 2, {}).truth.errors.camera;
  EXPECT_FLOAT_EQ(e.shade(0), 1);
  EXPECT_FLOAT_EQ(e.shade(1), 0.65F);
  EXPECT_FLOAT_EQ(e.response(255), 255);
  EXPECT_NEAR(e.response(255 * 0.2F), 255 * 0.4811F, 0.1F);
  EXPECT_EQ(e.response(-3), 0);
  float most = 0;
  for (int i = 0; i < 90; ++i) most = std::max(most, std::abs(e.tint(0.1 * i)[0] - 1));
  EXPECT_NEAR(most, 0.08F, 0.001F);
}

TEST(RoughCamera, ItsDescriptionIsNearlyRight) {
  const RoughRobot robot = rough_robot({}, 1, rough_parts("camera"));
  const CameraModel &truth = robot.truth.camera, &known = robot.known.camera;
  EXPECT_EQ(known.fx, CameraModel().fx);
  EXPECT_NEAR(std::abs(truth.fx / known.fx - 1), 0.0015, 0.0005);
  EXPECT_EQ(truth.cx, known.cx);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(std::abs(truth.distortion[i] / known.distortion[i] - 1), 0.015, 0.005);
}

TEST(RoughCamera, RowsAreReadOutAfterEachOther) {
  SimulatorConfig config = rough_one(small(8), 2, "camera");
  config.camera.cx = 40, config.camera.cy = 30;
  const Simulator simulator(scenario("spin"), config);
  const auto torso = [&](double t) { return simulator.walk().torso(t); };
  const auto image = [&](double t, double readout) {
    config.errors.camera->readout = readout;
    return CameraSensor(config, simulator.world()).image(0, t, torso, Workers(1)).pixels;
  };
  // By how much four rows of the middle and four at the ends differ from those of a global shutter, in the sum of all grey levels.
  const auto differing = [&](double t) {
    const auto global = image(t, 0), rolling = image(t, 0.015);
    std::array<int, 2> sums{};
    for (std::size_t i = 0; i < global.size(); ++i) {
      const std::size_t row = i / (std::size_t{80} * 3);
      if (row >= 28 && row < 32) sums[0] += std::abs(global[i] - rolling[i]);
      if (row < 2 || row >= 58) sums[1] += std::abs(global[i] - rolling[i]);
    }
    return sums;
  };
  const auto standing = differing(1), turning = differing(7);
  EXPECT_EQ(standing[0] + standing[1], 0);
  EXPECT_GT(turning[1], 100 + 3 * turning[0]);
}

TEST(RoughMount, SensorsAreOffByThatMuchAndTheTruthIsOfTheTrueImu) {
  const RoughRobot robot = rough_robot(only({Sensor::imu}, 0.1), 2, rough_parts("mount"));
  const BipedShape &truth = robot.truth.shape, &known = robot.known.shape;
  const auto expect_off = [](const SE3& a, const SE3& b, double angle, double distance) {
    EXPECT_NEAR((a.R.inverse() * b.R).Log().norm(), angle * degree, 1e-9);
    EXPECT_NEAR((a.p - b.p).norm(), distance, 1e-9);
  };
  expect_off(known.T_imu_lidar, truth.T_imu_lidar, 0.5, 0.008);
  expect_off(known.T_torso_imu(), truth.T_torso_imu(), 1, 0.010);
  expect_off(known.T_torso_imu().inverse() * robot.known.camera.T_torso_camera,
             truth.T_torso_imu().inverse() * robot.truth.camera.T_torso_camera, 0.6, 0.008);
  const Simulator simulator(scenario("room"), robot.truth);
  expect_off(simulator.walk().imu(0.05), simulator.walk().torso(0.05) * truth.T_torso_imu(), 0, 0);
}

TEST(RoughTime, StampsAreLateAndTheTruthSaysByHowMuch) {
  const RoughRobot robot = rough_robot(only({Sensor::lidar}, 4), 2, rough_parts("time"));
  SimulatorConfig config = robot.truth;
  config.lidar.points = 10;
  Simulator simulator(scenario("stand"), config);
  double sum = 0, squares = 0, n = 0;
  while (const auto m = simulator.next()) {
    const double late = to_seconds(stamp_of(*m) - simulator.measured()) - 0.006;
    EXPECT_GE(simulator.arrived(), stamp_of(*m));
    sum += late, squares += late * late, ++n;
  }
  EXPECT_NEAR(sum / n, 0, 4 * 0.0015 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(squares / n), 0.0015, 0.0006);
  EXPECT_THAT(simulated_config(robot.known, "x"), Not(HasSubstr("time_offset")));
  for (const char* line : {"  time_offset: -0.004\n", "  time_offset: -0.006\n", "  time_offset: -0.012\n"})
    EXPECT_THAT(simulated_config(robot.truth, "x"), HasSubstr(line));
}

TEST(RoughLegs, AreWornAndOnlyTheirMessagesGetLost) {
  const RoughRobot robot = rough_robot(only({Sensor::imu, Sensor::legs}, 10), 2, rough_parts("legs"));
  Simulator simulator(scenario("stand"), robot.truth);
  double imu = 0, legs = 0;
  while (const auto m = simulator.next()) (sensor_of(*m) == Sensor::imu ? imu : legs) += 1;
  EXPECT_EQ(imu, 2001);
  EXPECT_NEAR(legs, 5001 * (1 - 0.01 + 0.003), 4 * std::sqrt(5001 * 0.013));
  double squares = 0;
  for (const double zero : simulator.joint_zeros()) squares += zero * zero / 13;
  EXPECT_NEAR(std::sqrt(squares), 0.6 * degree, 0.35 * degree);  // 13 draws
  EXPECT_NE(simulator.walk().shape().thigh, robot.known.shape.thigh);
  EXPECT_DOUBLE_EQ(robot.truth.wear.backlash, 0.3 * degree);
  EXPECT_EQ(robot.known.joints.delivery.rate, 500);
  const SimulatorConfig worn = robot_of(scenario("worn"));
  EXPECT_EQ(rough_one(worn, 1, "legs").wear.flex, worn.wear.flex);  // the walk's own is worse
}

TEST(RoughScene, ThingsStandBesideTheWayAndNothingElseChanges) {
  for (const char* name : {"room", "yard", "corridor"}) {
    const Simulator simulator(scenario(name), only({Sensor::imu}, 1));
    const Scene before = make_scene(scenario(name).world, 1), after = cluttered(before, simulator.walk(), 15, 1);
    ASSERT_GT(after.surfaces.size(), before.surfaces.size() + 15 * 6) << name;
    for (std::size_t i = 0; i < before.surfaces.size(); ++i) ASSERT_EQ(before.surfaces[i].corner, after.surfaces[i].corner);
    double nearest = 9;
    for (std::size_t i = before.surfaces.size(); i < after.surfaces.size(); ++i) {
      const Surface& s = after.surfaces[i];
      const Eigen::Vector3d middle = s.corner + (s.u + s.v) / 2;
      for (double t = 0; t < simulator.walk().end(); t += 0.5)
        nearest = std::min(nearest, (simulator.walk().pelvis(t).p - middle).head<2>().norm());
    }
    EXPECT_GT(nearest, 0.5) << name;
  }
}

TEST(RoughRecord, NamesWhatWasDone) {
  const RoughParts parts = rough_parts("imu,legs");
  const Simulator simulator(scenario("room"), rough_robot(only({Sensor::imu}, 1), 1, parts).truth);
  const std::string text = rough_record(1, parts, simulator);
  for (const char* part : {"level: 1\nparts: [imu,legs]\n", "\nimu:\n  gyro_matrix: [", "\nlegs:\n  zeros: {left_hip_pitch_joint: "})
    EXPECT_THAT(text, HasSubstr(part));
  EXPECT_THAT(text, Not(HasSubstr("lidar:")));
}

}  // namespace rough_test
}  // namespace kilvo::lab
