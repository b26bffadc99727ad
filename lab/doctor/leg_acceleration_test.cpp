// What standing legs say of the acceleration: lengths, mount and clock of a walk that is known.
#include "lab/doctor/leg_acceleration.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <random>

#include "lab/doctor/examination.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace leg_acceleration_test {

/// Legs and IMU from one time to another of a simulated walk, which stands for 3 s first.
struct Walked {
  Recorded recorded;
  Robot robot;
};

Walked walked(const std::string& name, double from, double to) {
  SimulatorConfig config;
  config.duration = to;
  config.use = {true, true, false, false};
  const std::vector<Scenario> all = scenarios();
  Simulator simulator(*std::ranges::find(all, name, &Scenario::name), config);
  Recorder recorder;
  Walked out;
  while (const auto measurement = simulator.next()) {
    if (to_seconds(stamp_of(*measurement) - simulator.start()) >= from) recorder.push(*measurement);
  }
  out.recorded = recorder.finish();
  const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
  out.robot = parse_settings(simulated_config(config, urdf), "simulated", ".").robot;
  out.robot.urdf = urdf_of(config.shape);
  return out;
}

std::vector<LegPose> path_of(const Walked& walk) {
  RecordedLegs legs(walk.recorded);
  return legs.path(walk.robot, nullptr, pose_period, nullptr);
}

/// As Examination asks for it, with what is wrong.
LegAcceleration measured(const Walked& walk, double scale, const SO3& turn, double late) {
  std::vector<LegPose> path = path_of(walk);
  const Eigen::Vector3d p = walk.robot.imu.T_link_imu.p;
  for (LegPose& pose : path) {
    pose.t += late;
    for (FootPose& foot : pose.foot) {
      for (Eigen::Vector3d& corner : foot.p) corner = p + scale * (corner - p);
    }
  }
  const GyroPath gyro(walk.recorded.imu, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  SE3 T_link_imu = walk.robot.imu.T_link_imu;
  T_link_imu.R = turn * T_link_imu.R;
  return fit_leg_acceleration(path, MeasuredForce(walk.recorded.imu, gyro), T_link_imu, 0);
}

const Walked& a_walk() {
  static const Walked walk = walked("room", 0, 16);
  return walk;
}

TEST(LegAcceleration, OfARightDescriptionIsTheAccelerometers) {
  const LegAcceleration fit = measured(a_walk(), 1, SO3{}, 0);
  ASSERT_TRUE(fit.good);
  EXPECT_GT(fit.explained, 0.95);
  EXPECT_NEAR(fit.least_scale, 1, 0.02);
  EXPECT_NEAR(fit.most_scale, 1, 0.04);
  EXPECT_LT(fit.scale_sigma, 0.02);
  EXPECT_LT(degrees(fit.turn.norm()), 1);
  EXPECT_NEAR(fit.offset, 0, 0.002);
}

TEST(LegAcceleration, TellsTheSizeOfTheLegs) {
  for (const double scale : {0.85, 1.2, 2.0}) {
    const LegAcceleration fit = measured(a_walk(), scale, SO3{}, 0);
    ASSERT_TRUE(fit.good) << scale;
    EXPECT_NEAR(fit.least_scale / scale, 1, 0.03) << scale;
    EXPECT_NEAR(fit.most_scale / scale, 1, 0.05) << scale;
  }
}

TEST(LegAcceleration, TellsTheMountOfTheImu) {
  for (const Eigen::Vector3d& by : {Eigen::Vector3d(0, 0.1, 0), Eigen::Vector3d(-0.08, 0, 0.06)}) {
    const LegAcceleration fit = measured(a_walk(), 1, SO3::Exp(by), 0);
    ASSERT_TRUE(fit.good) << by.transpose();
    const SO3 described = (SO3::Exp(by) * a_walk().robot.imu.T_link_imu.R).inverse(), truth = a_walk().robot.imu.T_link_imu.R.inverse();
    EXPECT_LT(degrees((described * SO3::Exp(fit.turn) * truth.inverse()).Log().norm()), 1.5) << by.transpose();
  }
}

TEST(LegAcceleration, TellsTheClockOfTheLegs) {
  for (const double late : {-0.03, 0.008, 0.06}) EXPECT_NEAR(measured(a_walk(), 1, SO3{}, late).offset, -late, 0.003) << late;
}

TEST(LegAcceleration, OfARobotThatStandsIsSureOfNothing) {
  const LegAcceleration fit = measured(walked("stand", 0, 10), 1, SO3{}, 0);
  EXPECT_TRUE(!fit.good || sure * fit.scale_sigma > fit.least_scale) << fit.least_scale << " +- " << fit.scale_sigma;
}

// Too few rows are no legs that do not accelerate as the robot does.
TEST(LegAcceleration, OfAShortWalkIsNotKnown) {
  const LegAcceleration fit = measured(walked("room", 3, 5.5), 1, SO3{}, 0);
  EXPECT_FALSE(fit.good);
  EXPECT_EQ(fit.rows, 0u);
}

// Rows in which the robot falls freely are none of a sole that stands.
TEST(LegAcceleration, OfARunnerIsThatOfItsStances) {
  const LegAcceleration fit = measured(walked("run", 4, 16), 1, SO3{}, 0);
  EXPECT_TRUE(!fit.good || std::abs(fit.least_scale - 1) < std::max(0.05, sure * fit.scale_sigma)) << fit.least_scale;
}

// Steps, slabs that shift, soft ground and flight accuse nobody, however short the recording is: 3 s hold too few steps for anything.
TEST(LegAcceleration, AccusesNoRightDescription) {
  struct Cut {
    const char* name;
    double from, to;
  };
  for (const Cut& cut :
       {Cut{"room", 3, 7}, Cut{"forward", 3, 8}, Cut{"in_place", 3, 7}, Cut{"tiles", 4, 12}, Cut{"run", 7, 16}, Cut{"soft", 3, 8}}) {
    const Walked walk = walked(cut.name, cut.from, cut.to);
    const Diagnosis diagnosis = Examination(walk.recorded, walk.robot).run();
    EXPECT_TRUE(diagnosis.good()) << cut.name << ": " << diagnosis.findings.front().text;
  }
}

TEST(LegAcceleration, DiffersLeastAsItIs) {
  const double right = measured(a_walk(), 1, SO3{}, 0).differs();
  EXPECT_LT(right, 0.05);
  EXPECT_GT(measured(a_walk(), 2, SO3{}, 0).differs(), 0.5);
  EXPECT_GT(measured(a_walk(), 0.5, SO3{}, 0).differs(), 0.2);
  EXPECT_EQ(LegAcceleration{}.differs(), INFINITY);
}

// Encoders that are rough make them differ as well.
TEST(LegAcceleration, IsContradictedByLegsThatMoveOtherwiseAndNotByNoise) {
  const Walked& walk = a_walk();
  const auto with = [&walk](const std::function<void(Eigen::Vector3d&)>& change) {
    std::vector<LegPose> path = path_of(walk);
    for (LegPose& pose : path) {
      for (FootPose& foot : pose.foot) {
        const Eigen::Vector3d corner = foot.p[0];
        Eigen::Vector3d moved = corner;
        change(moved);
        for (Eigen::Vector3d& p : foot.p) p += moved - corner;
      }
    }
    const GyroPath gyro(walk.recorded.imu, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
    return fit_leg_acceleration(path, MeasuredForce(walk.recorded.imu, gyro), walk.robot.imu.T_link_imu, 0);
  };
  EXPECT_LT(with([](Eigen::Vector3d&) {}).contradicts, 0.1);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.006);  // m
  const LegAcceleration rough = with([&](Eigen::Vector3d& p) { p += Eigen::Vector3d(noise(random), noise(random), noise(random)); });
  EXPECT_GT(rough.differs(), 1);
  // Rows that differ by much have less weight, so that less of the noise is in it than is taken off.
  EXPECT_LT(rough.contradicts, 0.1);
  EXPECT_GT(rough.contradicts, -0.4 * rough.noise);
  const LegAcceleration backwards = with([](Eigen::Vector3d& p) { p = {-p.x(), -p.y(), p.z()}; });
  EXPECT_GT(backwards.contradicts, 1.5);
}

/// On soft ground soles turn under the robot: ankles that turn by 3 degrees twice a second.
Walked on_turning_soles() {
  Walked walk = walked("room", 0, 24);
  for (const std::string joint : {"left_ankle_pitch_joint", "left_ankle_roll_joint", "right_ankle_pitch_joint", "right_ankle_roll_joint"}) {
    const auto place = static_cast<std::size_t>(std::ranges::find(walk.recorded.joint_names, joint) - walk.recorded.joint_names.begin());
    for (LegSample& s : walk.recorded.legs) {
      const double turned = 0.06 * std::sin(12 * s.t + static_cast<double>(place));
      if (place < s.position.size()) s.position[place] += turned;
    }
  }
  return walk;
}

Diagnosis of_legs_and_imu(const Walked& walk) { return Examination(walk.recorded, walk.robot).run(); }

TEST(LegAcceleration, OnSolesThatTurnShowsWhatTheirTurningHides) {
  const Walked right = on_turning_soles();
  EXPECT_TRUE(of_legs_and_imu(right).good());
  Walked turned = right;
  turned.robot.imu.T_link_imu.R = SO3::Exp({0, 0, M_PI}) * right.robot.imu.T_link_imu.R;
  const Diagnosis by_mount = of_legs_and_imu(turned);
  ASSERT_FALSE(by_mount.findings.empty());
  EXPECT_EQ(by_mount.findings.front().cause, "imu_mount_rotation");
  EXPECT_NEAR(by_mount.findings.front().size, 180, 8);
  Walked late = right;
  for (LegSample& s : late.recorded.legs) s.t += 0.3;
  const Diagnosis by_clock = of_legs_and_imu(late);
  ASSERT_FALSE(by_clock.findings.empty());
  EXPECT_EQ(by_clock.findings.front().cause, "legs_clock");
  EXPECT_NEAR(by_clock.findings.front().size, -0.3, 0.03);
}

TEST(LegAcceleration, OnSolesThatTurnShowsAnyMount) {
  const Walked right = on_turning_soles();
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 0, 45), Eigen::Vector3d(30, -20, 0), Eigen::Vector3d(60, 40, 80)}) {
    Walked turned = right;
    const SO3 turn = SO3::Exp(axis * M_PI / 180);
    turned.robot.imu.T_link_imu.R = turn * right.robot.imu.T_link_imu.R;
    const Diagnosis diagnosis = of_legs_and_imu(turned);
    ASSERT_EQ(diagnosis.findings.size(), 1U) << axis.transpose();
    EXPECT_EQ(diagnosis.findings.front().cause, "imu_mount_rotation");
    EXPECT_NEAR(diagnosis.findings.front().size, degrees(turn.Log().norm()), 6);
  }
}

// The joints of another walk: none of the changes that are tried makes them those of this one.
TEST(LegAcceleration, OfLegsThatMoveOtherwiseContradicts) {
  Walked walk = walked("room", 3, 24);
  walk.recorded.legs = walked("fast_walk", 3, 24).recorded.legs;
  const Diagnosis diagnosis = of_legs_and_imu(walk);
  ASSERT_FALSE(diagnosis.findings.empty());
  EXPECT_EQ(diagnosis.findings.front().cause, "leg_joints") << diagnosis.findings.front().text;
}

// A robot that steps while it hangs from a crane shows nothing of its legs.
TEST(LegAcceleration, OfLegsThatStepInTheAirIsNotJudged) {
  Walked walk = walked("room", 3, 24);
  for (InertialSample& s : walk.recorded.imu) {
    s.gyro = {0.02 * std::sin(s.t), 0.05 * std::sin(1.3 * s.t), 0.03};
    s.accel = walk.robot.imu.T_link_imu.R.inverse() * Eigen::Vector3d(0.3 * std::sin(1.5 * s.t), 0.02 * std::sin(90 * s.t), 9.81);
  }
  EXPECT_TRUE(of_legs_and_imu(walk).good());
}

}  // namespace leg_acceleration_test
}  // namespace kilvo::lab
