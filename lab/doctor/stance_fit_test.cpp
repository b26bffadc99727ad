// Feet that stand by the way of the body tell the clock of the legs and the mount of the IMU.
#include "lab/doctor/stance_fit.hpp"

#include <gtest/gtest.h>

#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace {

/// 9 s in a room, of which the robot walks 5, with the true way of its IMU at 10 Hz.
class StancesOfAWalk : public testing::Test {
 protected:
  static SimulatorConfig config() {
    SimulatorConfig out;
    out.duration = 9;
    out.use = {true, true, false, false};
    return out;
  }
  static Scenario room() {
    const std::vector<Scenario> all = scenarios();
    return *std::ranges::find(all, "room", &Scenario::name);
  }
  static Recorded record(Simulator& simulator) {
    Recorder recorder;
    while (auto measurement = simulator.next()) recorder.push(*measurement);
    return recorder.finish();
  }
  static Robot describe() {
    const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
    Robot out = parse_settings(simulated_config(config(), urdf), "simulated", ".").robot;
    out.urdf = urdf_of(config().shape);
    return out;
  }
  static std::vector<SweepPose> poses(const Simulator& simulator, const Recorded& recorded) {
    const double start = to_seconds(simulator.start() - time_from_ns(recorded.origin));
    std::vector<SweepPose> out;
    for (double t = 0.1; t < config().duration - 0.1; t += 0.1) {
      SweepPose pose;
      pose.t = pose.begin = pose.end = start + t;
      pose.T_WL = simulator.walk().imu(t);
      pose.weakest = 1;
      pose.good = true;
      out.push_back(pose);
    }
    return out;
  }
  LegStart found(const Recorded& recorded, const Robot& robot) const {
    RecordedLegs legs(recorded);
    return longest_standing(legs, robot, nullptr, way_, gyro_, mounts_);
  }

  const Scenario scenario_ = room();
  Simulator simulator_{scenario_, config()};
  const Recorded recorded_ = record(simulator_);
  const Robot robot_ = describe();
  const std::vector<SO3> mounts_{SO3::Exp({0, 0, 3}), SO3{}, robot_.imu.T_link_imu.R};
  const GyroPath gyro_{recorded_.imu, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const LidarWay way_{poses(simulator_, recorded_), SE3{}, 0, recorded_.imu, gyro_, Eigen::Vector3d(0, 0, -Simulator::gravity),
                      Eigen::Vector3d::Zero()};
};

TEST_F(StancesOfAWalk, LastLongestWithTheRightClock) {
  for (const double late : {-0.1, 0.35, 1.0}) {
    Recorded shifted = recorded_;
    for (LegSample& s : shifted.legs) s.t += late;
    const LegStart start = found(shifted, robot_);
    EXPECT_NEAR(start.offset, -late, 0.02);
    EXPECT_LT((start.R_link_imu * robot_.imu.T_link_imu.R.inverse()).Log().norm(), 1e-9);
    RecordedLegs legs(shifted);
    const Standing described = standing_time(legs, robot_, nullptr, way_, gyro_, 0);
    EXPECT_LT(described.worth(), 0.5 * start.standing.worth()) << late;
  }
}

TEST_F(StancesOfAWalk, LastLongestWithTheRightMount) {
  Robot turned = robot_;
  const SO3 right = robot_.imu.T_link_imu.R;
  turned.imu.T_link_imu.R = SO3::Exp({0, 0, 1.5707963267948966}) * right;
  const LegStart start = found(recorded_, turned);
  EXPECT_LT((start.R_link_imu * right.inverse()).Log().norm(), 0.01);
  EXPECT_EQ(start.offset, 0);
}

TEST_F(StancesOfAWalk, LastForMostOfTheWalkAsItIsDescribed) {
  RecordedLegs legs(recorded_);
  const Standing s = standing_time(legs, robot_, nullptr, way_, gyro_, 0);
  EXPECT_GT(s.moving, 4);
  EXPECT_GT(s.worth(), 0.5 * s.moving);
}

}  // namespace
}  // namespace kilvo::lab
