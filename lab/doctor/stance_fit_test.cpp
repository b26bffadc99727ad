// Feet that stand by the way of the body tell the clock of the legs and the mount of the IMU.
#include "lab/doctor/stance_fit.hpp"

#include <gtest/gtest.h>

#include "lab/doctor/robust_fit.hpp"
#include "lab/doctor/stances.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace stance_fit_test {

/// 20 s in a room, of which the robot walks 16, with the true way of its IMU at 10 Hz.
class StancesOfAWalk : public testing::Test {
 protected:
  static SimulatorConfig config() {
    SimulatorConfig out;
    out.duration = 20;
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

// Among mounts of which none lets them stand: the fit from the best of them does.
TEST_F(StancesOfAWalk, TellAMountBetweenThoseThatAreTried) {
  const SO3 right = robot_.imu.T_link_imu.R;
  Robot turned = robot_;
  turned.imu.T_link_imu.R = SO3::Exp({0, 0, 0.8}) * right;
  const std::vector<SO3> around{SO3::Exp({0, 0.03, 0.1}) * right, SO3::Exp({0, 0.03, -1.5}) * right, SO3::Exp({0, 0, 3}) * right};
  RecordedLegs legs(recorded_);
  const LegStart tried = longest_standing(legs, turned, nullptr, way_, gyro_, around);
  const LegStart fitted = fitted_standing(legs, turned, nullptr, way_, gyro_, around, 0.002);
  EXPECT_LT((fitted.R_link_imu * right.inverse()).Log().norm(), 0.004);
  EXPECT_NEAR(fitted.offset, 0, 0.001);
  EXPECT_GT(fitted.standing.worth(), 2 * tried.standing.worth());
  EXPECT_GT(fitted.standing.worth(), 0.5 * fitted.standing.moving);
}

// A clock that is off by more than the fit may change it by is none that it has found.
TEST_F(StancesOfAWalk, TellNoClockThatIsFarOff) {
  for (const double late : {-0.06, 0.06}) {
    Recorded shifted = recorded_;
    for (LegSample& s : shifted.legs) s.t += late;
    RecordedLegs legs(shifted);
    const StanceFit fit = fit_stances(legs, robot_, nullptr, way_, gyro_, 0);
    EXPECT_FALSE(fit.good) << fit.offset;
  }
}

TEST_F(StancesOfAWalk, LastForMostOfTheWalkAsItIsDescribed) {
  RecordedLegs legs(recorded_);
  const Standing s = standing_time(legs, robot_, nullptr, way_, gyro_, 0);
  EXPECT_GT(s.moving, 4);
  EXPECT_GT(s.worth(), 0.5 * s.moving);
}

TEST_F(StancesOfAWalk, TellTheMountAndTheClock) {
  Recorded late = recorded_;
  for (LegSample& s : late.legs) s.t += 0.006;
  Robot turned = robot_;
  turned.imu.T_link_imu.R = SO3::Exp({0.02, -0.02, 0.03}) * robot_.imu.T_link_imu.R;
  RecordedLegs legs(late);
  const StanceFit fit = fit_stances(legs, turned, nullptr, way_, gyro_, 0);
  ASSERT_TRUE(fit.good);
  EXPECT_LT((fit.R_link_imu * robot_.imu.T_link_imu.R.inverse()).Log().norm(), 0.004);
  EXPECT_NEAR(fit.offset, -0.006, 0.0008);
}

// A body that moves by 0.5 m/s over a sole moves that by half a millimetre in a millisecond.
TEST_F(StancesOfAWalk, AreFoundWhereStampsJitter) {
  Recorded jittering = recorded_;
  for (std::size_t i = 0; i < jittering.legs.size(); ++i) jittering.legs[i].t += i % 2 == 0 ? 0.0015 : -0.0015;
  RecordedLegs right(recorded_), legs(jittering);
  const StanceFit without = fit_stances(right, robot_, nullptr, way_, gyro_, 0), with = fit_stances(legs, robot_, nullptr, way_, gyro_, 0);
  ASSERT_TRUE(without.good);
  ASSERT_TRUE(with.good);
  EXPECT_GE(static_cast<double>(with.stances), 0.8 * static_cast<double>(without.stances));
  EXPECT_LT((with.R_link_imu * robot_.imu.T_link_imu.R.inverse()).Log().norm(), 0.004);
}

TEST_F(StancesOfAWalk, TellTheSizeOfTheLegsWhereItIsFree) {
  BipedShape larger = config().shape;
  larger.thigh *= 1.1, larger.shin *= 1.1;
  Robot described = robot_;
  described.urdf = urdf_of(larger);
  RecordedLegs legs(recorded_);
  const StanceFit fit = fit_stances(legs, described, nullptr, way_, gyro_, 0, {std::nullopt, false, true});
  ASSERT_TRUE(fit.good);
  EXPECT_NEAR(fit.scale, 1 / 1.1, 0.03);
}

TEST_F(StancesOfAWalk, TellAZeroThatIsFarOffWhereItIsFree) {
  Recorded bent = recorded_;
  const auto knee = static_cast<std::size_t>(std::ranges::find(bent.joint_names, "right_knee_joint") - bent.joint_names.begin());
  ASSERT_LT(knee, bent.joint_names.size());
  for (LegSample& s : bent.legs) s.position[knee] += 0.2;
  RecordedLegs legs(bent);
  const StanceFit described = fit_stances(legs, robot_, nullptr, way_, gyro_, 0);
  ASSERT_TRUE(described.good);
  const auto joint = static_cast<std::size_t>(std::ranges::find(described.joints, "right_knee_joint") - described.joints.begin());
  const StanceFit free = fit_stances(legs, robot_, nullptr, way_, gyro_, 0, {joint, false});
  ASSERT_TRUE(free.good);
  EXPECT_NEAR(free.zero[joint], -0.2, 0.03);
  EXPECT_LT(free.moved, 0.88 * described.moved);
}

TEST_F(StancesOfAWalk, TellThatTheFeetAreFartherApart) {
  Robot wide = robot_;
  auto shape = config().shape;
  shape.hip.y() += 0.05;
  wide.urdf = urdf_of(shape);
  RecordedLegs legs(recorded_);
  const StanceFit fit = fit_stances(legs, wide, nullptr, way_, gyro_, 0, {std::nullopt, true});
  ASSERT_TRUE(fit.good);
  EXPECT_NEAR(fit.apart.y(), -0.05, 0.01);
  EXPECT_LT(std::hypot(fit.apart.x(), fit.apart.z()), 0.015);
}

// Each column of the derivative against central differences, away from where the unknowns are zero. The clock's follows the way between
// the IMU's samples, of which a difference sees two.
TEST_F(StancesOfAWalk, HaveTheDerivativesThatTheirDifferencesShow) {
  RecordedLegs legs(recorded_);
  Stances stances(legs, robot_, nullptr, way_, gyro_, 0, true);
  Eigen::VectorXd x = Eigen::VectorXd::Constant(stances.unknowns(), 0.004);
  x[Stances::of_offset] = 0.0007;
  stances.find(x, true);
  ASSERT_GT(stances.stances(), 10U);
  Residuals at;
  stances.rows(x, at);
  Derivatives J(static_cast<Eigen::Index>(at.r.size()), x.size());
  stances.derivative(x, J);
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    const double step = 1e-5;
    Residuals up, down;
    Eigen::VectorXd moved = x;
    moved[j] = x[j] + step;
    stances.rows(moved, up);
    moved[j] = x[j] - step;
    stances.rows(moved, down);
    const Eigen::Map<const Eigen::VectorXd> r_up(up.r.data(), J.rows()), r_down(down.r.data(), J.rows());
    const Eigen::VectorXd expected = (r_up - r_down) / (2 * step);
    EXPECT_LT((J.col(j) - expected).norm(), (j == Stances::of_offset ? 0.05 : 1e-3) * expected.norm()) << "unknown " << j;
  }
}

// r = (exp(a x) + b) - y, with outliers.
TEST(RobustFit, IsTheSameByDerivativesAsByDifferences) {
  const auto place = [](int i) { return 0.01 * i; };
  const auto rows = [&place](const Eigen::VectorXd& x, Residuals& out) {
    out.width = 1;
    for (int i = 0; i < 200; ++i) {
      const double y = std::exp(0.7 * place(i)) - 0.3 + 0.01 * std::sin(7.0 * i) + (i % 10 == 0 ? 1 : 0);
      out.r.push_back(std::exp(x[0] * place(i)) + x[1] - y);
      out.block.push_back(i / 20);
    }
  };
  const auto derivative = [&place](const Eigen::VectorXd& x, Derivatives& J) {
    for (int i = 0; i < 200; ++i) J.row(i) << place(i) * std::exp(x[0] * place(i)), 1;
  };
  const Eigen::VectorXd start = Eigen::Vector2d(0.5, 0), prior = Eigen::Vector2d(INFINITY, INFINITY), step = Eigen::Vector2d(1e-5, 1e-5);
  const Fit by_differences = robust_fit(rows, start, prior, step), fit = robust_fit(rows, start, prior, step, 12, derivative);
  ASSERT_TRUE(fit.good && by_differences.good);
  EXPECT_NEAR(fit.x[0], 0.7, 0.01);
  EXPECT_NEAR(fit.x[1], -0.3, 0.01);
  EXPECT_LT((fit.x - by_differences.x).norm(), 1e-6);
  EXPECT_LT((fit.cov - by_differences.cov).norm(), 1e-3 * by_differences.cov.norm());
}

TEST(StanceFit, IsAsUncertainAsItIsFarFromTheTurning) {
  const SO3 by_stances = SO3::Exp({0, 0.12, 0}), by_turning = SO3::Exp({0.01, -0.04, 0});
  const Eigen::Vector3d sigma(0.01, 0.01, 0.01), of_turning(0.02, 0.02, 0.02);
  const Eigen::Vector3d beside = sigma_beside(by_stances, sigma, by_turning, of_turning);
  EXPECT_NEAR(beside.x(), 0.01, 1e-6) << "they agree";
  EXPECT_NEAR(beside.y(), 0.16 - 2 * std::hypot(0.01, 0.02), 1e-3);
  EXPECT_EQ(sigma_beside(by_stances, sigma, SO3::Exp({0, 1.5, 0}), of_turning), sigma) << "another start";
}

}  // namespace stance_fit_test
}  // namespace kilvo::lab
