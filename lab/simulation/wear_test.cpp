#include "lab/simulation/wear.hpp"

#include <gtest/gtest.h>

#include "lab/simulation/units.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo::lab {
namespace wear_test {

using test::all_of;
using test::scenario;

SimulatorConfig legs_of(const std::string& name, double duration) {
  SimulatorConfig config = robot_of(scenario(name));
  config.use = {true, true, false, false};
  config.duration = duration;
  return config;
}

std::vector<JointSample> joints_of(const SimulatorConfig& config) {
  Simulator simulator(scenario("room"), config);
  std::vector<JointSample> out;
  for (const Measurement& m : all_of(simulator)) {
    if (const auto* joints = std::get_if<JointSample>(&m)) out.push_back(*joints);
  }
  return out;
}

// Speeds of the standing soles' centres as the URDF's robot sees them: its encoders, the true pelvis. m/s, sorted.
std::vector<double> stance_speeds(const SimulatorConfig& config, const std::string& name) {
  Simulator simulator(scenario(name), config);
  const Walk& walk = simulator.walk();
  std::vector<double> out;
  while (const auto m = simulator.next()) {
    const auto* joints = std::get_if<JointSample>(&*m);
    if (joints == nullptr) continue;
    const double s = simulator.seconds_of(simulator.measured());
    for (const Side side : {Side::left, Side::right}) {
      if (s < walk.plan().steps.front().begin || !walk.in_contact(side, s)) continue;
      const std::size_t from = side == Side::left ? 0 : leg_joint_count;
      const auto place = [&](double h) {
        LegAngles q;
        for (std::size_t k = 0; k < q.size(); ++k) q[k] = joints->position[from + k] + h * joints->velocity[from + k];
        return Eigen::Vector3d(walk.pelvis(s + h) * foot_in_pelvis(config.shape, side, q) * Eigen::Vector3d(0.035, 0, -0.035));
      };
      constexpr double h = 1e-4;
      out.push_back((place(h) - place(-h)).norm() / (2 * h));
    }
  }
  std::ranges::sort(out);
  return out;
}

TEST(Wear, ALoadedSoleSeemsToMoveAsThatOfARealRobot) {
  const auto ideal = stance_speeds(legs_of("room", 8), "room"), worn = stance_speeds(legs_of("worn", 8), "worn");
  const auto median = [](const std::vector<double>& v) { return v[v.size() / 2]; };
  EXPECT_LT(median(ideal), 0.03);
  EXPECT_GT(median(worn), 0.035);
  EXPECT_LT(median(worn), 0.08);
  EXPECT_GT(worn[worn.size() * 99 / 100], 0.15);
  EXPECT_LT(worn[worn.size() * 99 / 100], 0.6);
}

TEST(Wear, TheEncoderSitsOnTheSideOfThePlayThatTheTorquePressesItTo) {
  const Simulator simulator(scenario("room"), legs_of("room", 1));
  Wear wear({.backlash = 0.2 * degree}, simulator.walk(), 1);
  JointAngles effort{};
  effort.fill(10);
  double angle = wear.encoders(0, {}, effort).angle[0], moved = 0;
  EXPECT_DOUBLE_EQ(angle, 0.1 * degree);
  for (int i = 1; i <= 10; ++i) {
    effort.fill(i < 3 ? 0.1 : -10);  // too weak to press: it stays where it is
    const auto shown = wear.encoders(1e-3 * i, {}, effort);
    moved += 1e-3 * shown.velocity[0];
    if (i == 2) {
      EXPECT_DOUBLE_EQ(shown.angle[0], 0.1 * degree);
    }
    angle = shown.angle[0];
  }
  EXPECT_NEAR(angle, -0.1 * degree, 1e-12);
  EXPECT_NEAR(moved, -0.2 * degree, 1e-12);  // the velocity says the same
}

TEST(Wear, JointsGiveWayUnderTheirTorque) {
  const Simulator simulator(scenario("room"), legs_of("room", 1));
  Wear wear({.flex = 1 * degree}, simulator.walk(), 1);
  JointAngles effort{};
  for (int i = 0; i < 5; ++i) {
    effort.fill(10.0 * i);
    const auto shown = wear.encoders(0.01 * i, {}, effort);
    EXPECT_NEAR(shown.angle[3], -0.1 * degree * i, 1e-12);
    EXPECT_NEAR(shown.velocity[3], i == 0 ? 0 : -10 * degree, 1e-9);
  }
}

TEST(Wear, VelocitiesLagBehind) {
  const Simulator simulator(scenario("room"), legs_of("room", 1));
  Wear wear({.velocity_lag = 0.01}, simulator.walk(), 1);
  JointAngles rate{};
  double shown = 0;
  for (int i = 0; i <= 10; ++i) {
    rate.fill(i == 0 ? 0.0 : 1.0);
    shown = rate[0] + wear.encoders(1e-3 * i, rate, {}).velocity[0];
  }
  EXPECT_NEAR(shown, 1 - std::exp(-1), 1e-9);
}

TEST(Wear, MessagesAreLostAndRepeatedAsOftenAsAsked) {
  SimulatorConfig config = legs_of("room", 8);
  config.wear.lost = 0.05;
  config.wear.repeated = 0.02;
  const auto joints = joints_of(config);
  double repeated = 0;
  for (std::size_t i = 1; i < joints.size(); ++i) repeated += joints[i].t == joints[i - 1].t ? 1 : 0;
  const double lost = 8001 - (static_cast<double>(joints.size()) - repeated);
  EXPECT_NEAR(lost, 400, 3 * std::sqrt(8000 * 0.05));
  EXPECT_NEAR(repeated, 160, 3 * std::sqrt(8000 * 0.02));
}

TEST(Wear, StampsJitterAndNeverGoBack) {
  SimulatorConfig config = legs_of("room", 4);
  config.joints.delivery.rate = 100;
  config.wear.stamp_jitter = 1e-3;
  const auto joints = joints_of(config);
  double sum2 = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (i > 0) {
      EXPECT_GE(joints[i].t, joints[i - 1].t);
    }
    const double off = to_seconds(joints[i].t - time_from_ns(1'700'000'000'000'000'000)) - 0.01 * static_cast<double>(i);
    sum2 += off * off;
  }
  EXPECT_NEAR(std::sqrt(sum2 / static_cast<double>(joints.size())), 1e-3, 1e-4);
}

TEST(Wear, AnUnfilteredImuAliasesTheVibrationOfTheWalkAndOfItAlone) {
  SimulatorConfig config = legs_of("room", 9);
  config.imu.delivery.rate = 50;
  config.wear.vibration = 5;
  Simulator simulator(scenario("room"), config);
  const Simulator ideal(scenario("room"), legs_of("room", 9));
  double standing = 0, walking = 0;
  int n = 0;
  for (const Measurement& m : all_of(simulator)) {
    const auto* imu = std::get_if<ImuSample>(&m);
    if (imu == nullptr) continue;
    const double s = simulator.seconds_of(imu->t);
    const Eigen::Vector3d still =
        ideal.walk().imu(s).R.inverse() * (ideal.walk().acceleration(s) + Eigen::Vector3d(0, 0, Simulator::gravity));
    const double off2 = (imu->accel - still).squaredNorm() / 3;
    if (s < 3) standing = std::max(standing, off2);
    if (s > 4) walking += off2, ++n;
  }
  EXPECT_LT(std::sqrt(standing), 0.2);
  EXPECT_NEAR(std::sqrt(walking / n), 5, 0.5);
}

TEST(Wear, TheRobotIsNotBuiltAsItsUrdfSays) {
  SimulatorConfig config = legs_of("room", 0.1);
  config.wear.link_length = 0.01;
  config.wear.zero_offset = 0.01;
  const Simulator simulator(scenario("room"), config);
  const BipedShape &true_shape = simulator.walk().shape(), &nominal = config.shape;
  EXPECT_NE(true_shape.thigh, nominal.thigh);
  EXPECT_NE(true_shape.shin, nominal.shin);
  EXPECT_NEAR(true_shape.thigh, nominal.thigh, 0.03 * nominal.thigh);
  double sum2 = 0;
  const auto joints = joints_of(config);
  const JointAngles angles = simulator.walk().joints(0);
  for (std::size_t k = 0; k < angles.size(); ++k) sum2 += std::pow(joints.front().position[k] - angles[k], 2);
  EXPECT_NEAR(std::sqrt(sum2 / static_cast<double>(angles.size())), 0.01, 0.006);  // 13 draws
}

// Each part has its own generator.
TEST(Wear, OnePartAloneIsTheSameAsAmongTheOthers) {
  SimulatorConfig alone = legs_of("room", 4), all = legs_of("worn", 4);
  alone.joints.delivery.rate = all.joints.delivery.rate;
  alone.wear.stamp_jitter = all.wear.stamp_jitter;
  alone.wear.lost = all.wear.lost;
  alone.wear.repeated = all.wear.repeated;
  const auto a = joints_of(alone), b = joints_of(all);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(a[i].t, b[i].t);
  EXPECT_NE(a.back().position, b.back().position);
}

}  // namespace wear_test
}  // namespace kilvo::lab
