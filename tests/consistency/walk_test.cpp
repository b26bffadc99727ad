// Is the error of a walking humanoid's estimate as large as the covariance says? Over seeds, in each modality.
// KILVO_SEEDS and KILVO_SECONDS make it a benchmark: KILVO_SEEDS=50 KILVO_SECONDS=20 kilvo_consistency_test. From KILVO_FIRST_SEED on:
// no noise of the filter was chosen on those above 1000.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <random>
#include <tuple>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/math/deterministic_sum.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"
#include "tests/consistency/known_world.hpp"

namespace kilvo {
namespace walk_test {

double number_of(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::atof(text) : otherwise;
}

const lab::Scenario& scenario_named(const std::string& name) { return *std::ranges::find(lab::scenarios(), name, &lab::Scenario::name); }

/// Of one output: squared error in units of the covariance, per part.
struct Sample {
  double pose = 0;          // 6 degrees of freedom
  double rotation = 0;      // 3
  double position = 0;      // 3
  double velocity = 0;      // 3
  double tilt = 0;          // 2: roll and pitch
  double worst_sigmas = 0;  // of the three components of position
  double sigma = 0;         // of position, m
};
using Samples = std::vector<Sample>;  // by tenth of a second after the start

double square(double x) { return x * x; }

// What a foot's velocity, as encoders and gyro tell it, is wrong by when its sole does not move: densities, m^2/s.
struct LegDensity {
  double across, vertical;
};
LegDensity leg_density(const lab::SimulatorConfig& config) {
  const lab::BipedShape& shape = config.shape;
  const double ankle = shape.sole_depth, knee = ankle + shape.shin, hip = knee + shape.thigh;
  // Forward hip, knee and ankle turn, sideways hip and ankle. The vertical only has the way from under them to where the sole stands, half
  // a step.
  const double forward = std::hypot(hip, knee, ankle), sideways = std::hypot(hip, ankle), vertical = 0.2;
  const auto of_rates = [&](double lever) { return square(lever * config.joints.velocity_noise) / config.joints.delivery.rate; };
  // What is wrong with a joint's zero turns the way that the foot goes under the body, for a stance: the hip's yaw to the side, the pitch
  // of hip and, by its part of the leg, knee up and down.
  constexpr double stance = 0.55, speed = 0.5;  // s, m/s
  const double of_zero = square(speed * config.joints.offset_sigma) * stance;
  // What the gyro says wrong turns the IMU about the sole. The settings know one density across: the mean of both ways, since the robot
  // turns.
  const double imu_height = hip - shape.hip.z() + shape.T_torso_imu().p.z();
  return {0.5 * (of_rates(forward) + of_rates(sideways) + of_zero) + square(imu_height * config.imu.gyro_noise),
          of_rates(vertical) + of_zero * (1 + square(knee / hip))};
}

/// One simulated walk, estimated by some of its sensors.
class Walk {
 public:
  Walk(std::uint64_t seed, double seconds, const std::string& name = "room", bool with_lidar = true) {
    lab::Scenario scenario = scenario_named(name);
    lab::SimulatorConfig config = lab::robot_of(scenario);
    config.seed = seed;
    config.duration = seconds;
    config.use[index_of(Sensor::camera)] = false;
    config.use[index_of(Sensor::lidar)] = with_lidar;
    // What planes are wrong by depends on the place: walks along one way would all be wrong alike.
    std::mt19937_64 random(seed);
    const auto within = [&random](double most) { return most * (2 * static_cast<double>(random() >> 11) / 9007199254740992.0 - 1); };
    scenario.start.x += within(0.3);
    scenario.start.y += within(0.3);
    scenario.start.yaw += within(0.15);
    simulator_ = std::make_unique<lab::Simulator>(std::move(scenario), config);
    while (auto m = simulator_->next()) measurements_.push_back(*std::move(m));
    if (with_lidar) seen_ = test::seen_points(*simulator_);
    settings_ =
        lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
    settings_.estimator.lidar.mount_error = false;  // it is exact
  }

  Samples estimated_by(std::array<bool, sensor_count> used) const {
    Estimator estimator(settings_.robot, settings_.estimator, used);
    return samples_of(estimator);
  }

  /// By the legs, with the noise of these legs on this floor and not of any on any.
  Samples estimated_by_rigid_legs() const {
    EstimatorConfig config = settings_.estimator;
    const LegDensity density = leg_density(simulator_->config());
    config.legs.velocity_correlation = 1 / simulator_->config().joints.delivery.rate;  // white
    config.legs.velocity_sigma = std::sqrt(density.across / config.legs.velocity_correlation);
    config.legs.vertical_velocity_sigma = std::sqrt(density.vertical / config.legs.velocity_correlation);
    // Where a foot is tells once more how fast it has been.
    config.legs.position_sigma = 0.001;
    config.noise.foot = 0.01;
    Estimator estimator(settings_.robot, config, {true, true, false, false});
    return samples_of(estimator);
  }

  /// The world's planes are known. The estimator's world begins where its first pose is, so that has to come first.
  Samples estimated_in_known_world_by(std::array<bool, sensor_count> used) const {
    Estimator first(settings_.robot, settings_.estimator, used), estimator(settings_.robot, settings_.estimator, used);
    std::vector<Output> outputs;
    for (auto m = measurements_.begin(); outputs.empty(); ++m) outputs = first.push(*m);
    const Output& begin = outputs.front();
    const SE3 T_WR = begin.x.pose() * simulator_->walk().imu(simulator_->seconds_of(begin.t)).inverse();
    estimator.give_map(test::known_world(seen_, T_WR, settings_.estimator.map));
    return samples_of(estimator);
  }

 private:
  Samples samples_of(Estimator& estimator) const {
    Samples out;
    std::optional<SE3> T_WR;
    const auto take = [&](const std::vector<Output>& outputs) {
      for (const Output& o : outputs) {
        const SE3 truth = simulator_->walk().imu(simulator_->seconds_of(o.t));
        if (!T_WR) T_WR = o.x.pose() * truth.inverse();
        const double s = simulator_->seconds_of(o.t) - 1.0;
        if (s < 0.1 * static_cast<double>(out.size())) continue;
        out.push_back(sample_of(o, *T_WR * truth, T_WR->R * simulator_->walk().velocity(simulator_->seconds_of(o.t))));
      }
    };
    for (const Measurement& m : measurements_) take(estimator.push(m));
    take(estimator.finish());
    return out;
  }

  static Sample sample_of(const Output& o, const SE3& truth, const Eigen::Vector3d& velocity) {
    Eigen::Matrix<double, 6, 1> e;
    e << (o.x.R.inverse() * truth.R).Log(), truth.p - o.x.p;
    const PoseCovariance P = o.P.topLeftCorner<6, 6>();
    const Eigen::Vector3d dv = velocity - o.x.v;
    // Tilt: the error of the direction of up, seen in the body; its two components across up.
    const Eigen::Vector3d up = o.x.R.inverse() * Eigen::Vector3d::UnitZ();
    Eigen::Matrix<double, 2, 3> across;
    across.row(0) = up.unitOrthogonal().transpose();
    across.row(1) = up.cross(up.unitOrthogonal()).transpose();
    const Eigen::Vector2d tilt = across * e.head<3>();
    const Eigen::Matrix2d T = across * P.topLeftCorner<3, 3>() * across.transpose();
    Sample out;
    out.pose = e.dot(P.ldlt().solve(e));
    const Eigen::Vector3d r = e.head<3>(), p = e.tail<3>();
    out.rotation = r.dot(P.topLeftCorner<3, 3>().ldlt().solve(r));
    out.position = p.dot(P.bottomRightCorner<3, 3>().ldlt().solve(p));
    out.velocity = dv.dot(o.P.block<3, 3>(at::v, at::v).ldlt().solve(dv));
    out.tilt = tilt.dot(T.ldlt().solve(tilt));
    out.worst_sigmas = (e.tail<3>().array().abs() / P.diagonal().tail<3>().array().sqrt()).maxCoeff();
    out.sigma = std::sqrt(P.diagonal().tail<3>().maxCoeff());
    return out;
  }

  std::unique_ptr<lab::Simulator> simulator_;
  std::vector<Measurement> measurements_;
  std::vector<Eigen::Vector3d> seen_;
  lab::Settings settings_;
};

constexpr std::array<bool, sensor_count> li = {true, false, true, false}, kil = {true, true, true, false}, ki = {true, true, false, false};

// All walks begin at one time and are in step: whatever a foot does when it comes down, it does in all of them at once, while a density
// says what it does over a stride. Begun up to two steps apart, each time meets all parts of the stride.
Samples out_of_step(Samples run, std::uint64_t seed) {
  constexpr std::uint64_t two_steps = 11;  // tenths of a second
  run.erase(run.begin(), run.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(7 * seed % two_steps, run.size())));
  return run;
}

class Consistency : public testing::Test {
 public:
  static void SetUpTestSuite() {
    const auto seeds = static_cast<std::uint64_t>(number_of("KILVO_SEEDS", 10));
    const auto first = static_cast<std::uint64_t>(number_of("KILVO_FIRST_SEED", 1));
    const Workers workers(static_cast<int>(number_of("KILVO_THREADS", 0)));
    all_ = workers.sum(seeds, 1, All{}, [&](std::size_t k, std::size_t) {
      const Walk walk(first + k, number_of("KILVO_SECONDS", 8));
      All out;
      for (const auto& used : {li, kil, ki}) out.runs[used].push_back(walk.estimated_by(used));
      out.worn.push_back(out_of_step(Walk(first + k, number_of("KILVO_SECONDS", 8), "worn", false).estimated_by(ki), first + k));
      out.rigid.push_back(out_of_step(walk.estimated_by_rigid_legs(), first + k));
      for (const auto& used : {li, kil}) out.known[used].push_back(walk.estimated_in_known_world_by(used));
      return out;
    });
  }
  static void TearDownTestSuite() { all_ = {}; }

  /// The mean over the runs at each time, and the share of times at which it is within [low, high].
  struct Share {
    double inside = 0, mean = 0;
  };
  static Share share(const std::vector<Samples>& runs, double Sample::*part, double low, double high) {
    std::size_t times = runs.front().size();
    for (const Samples& run : runs) times = std::min(times, run.size());
    Share out;
    for (std::size_t k = 0; k < times; ++k) {
      double mean = 0;
      for (const Samples& run : runs) mean += run[k].*part / static_cast<double>(runs.size());
      out.inside += (mean >= low && mean <= high ? 1.0 : 0.0) / static_cast<double>(times);
      out.mean += mean / static_cast<double>(times);
    }
    return out;
  }

  using Runs = std::map<std::array<bool, sensor_count>, std::vector<Samples>>;  // by the sensors that were used
  struct All {
    Runs runs, known;                  // with its own map, with the true one
    std::vector<Samples> rigid, worn;  // on the legs alone

    All& operator+=(const All& o) {
      for (const auto& [used, more] : o.runs) runs[used].insert(runs[used].end(), more.begin(), more.end());
      rigid.insert(rigid.end(), o.rigid.begin(), o.rigid.end());
      worn.insert(worn.end(), o.worn.begin(), o.worn.end());
      for (const auto& [used, more] : o.known) known[used].insert(known[used].end(), more.begin(), more.end());
      return *this;
    }
  };
  static All all_;
};

Consistency::All Consistency::all_;

TEST_F(Consistency, WithItsOwnMapTheErrorOfLiIsAsLargeAsTheCovarianceSays) {
  const Share pose = share(all_.runs.at(li), &Sample::pose, 0.4 * 6, 2.0 * 6);
  testing::Test::RecordProperty("pose", std::to_string(pose.mean / 6) + " inside at " + std::to_string(pose.inside));
  EXPECT_GE(pose.inside, 0.9) << "mean NEES per degree of freedom " << pose.mean / 6;
}

TEST_F(Consistency, WithItsOwnMapTheErrorOfKilIsAsLargeAsTheCovarianceSays) {
  const Share pose = share(all_.runs.at(kil), &Sample::pose, 0.4 * 6, 2.0 * 6);
  testing::Test::RecordProperty("pose", std::to_string(pose.mean / 6) + " inside at " + std::to_string(pose.inside));
  EXPECT_GE(pose.inside, 0.9) << "mean NEES per degree of freedom " << pose.mean / 6;
}

// Yaw, position and height cannot be observed from the legs: their uncertainty grows, and the error stays inside three of it.
TEST_F(Consistency, OnTheLegsAloneTheErrorStaysInsideAGrowingUncertainty) {
  int outside = 0, all = 0;
  for (const Samples& run : all_.runs.at(ki)) {
    for (const Sample& s : run) {
      outside += s.worst_sigmas > 3 ? 1 : 0;
      ++all;
    }
    EXPECT_GT(run.back().sigma, 2 * run.front().sigma);
  }
  EXPECT_LE(outside, all / 50) << "of " << all;
}

// The limits between which the mean over n runs of a chi-square value with k degrees of freedom lies 95 times in 100 (Wilson and
// Hilferty): of 3 and 50 runs 2.36 and 3.72.
struct Limits {
  double low, high;
};
Limits limits(double k, std::size_t n) {
  const double spread = 2.0 / (9 * k * static_cast<double>(n));
  return {k * std::pow(1 - spread - 1.96 * std::sqrt(spread), 3), k * std::pow(1 - spread + 1.96 * std::sqrt(spread), 3)};
}

// Strict: nothing that the estimator has made itself is in the error.
void expect_strict(const char* name, const std::vector<Samples>& runs, double Sample::*part, double degrees) {
  const Limits in = limits(degrees, runs.size());
  const auto all = Consistency::share(runs, part, in.low, in.high);
  testing::Test::RecordProperty(name, std::to_string(all.mean) + " inside at " + std::to_string(all.inside));
  // 95 of 100 of many; errors go on for most of a second, so that the 8 s of a few runs are ten times, and how many of them a matter of
  // luck.
  const double enough = runs.size() < 50 ? 0.85 : 0.9;
  EXPECT_GE(all.inside, enough) << "mean NEES of " << name << ' ' << all.mean << " of " << degrees;
}

// In the mean over all runs and times.
void expect_mean(const char* name, const std::vector<Samples>& runs, double Sample::*part, double degrees) {
  const Limits in = limits(degrees, 50);
  const double mean = Consistency::share(runs, part, in.low, in.high).mean;
  testing::Test::RecordProperty(name, std::to_string(mean));
  EXPECT_GT(mean, in.low) << name;
  EXPECT_LT(mean, in.high) << name;
}

TEST_F(Consistency, InAKnownWorldTheErrorOfLiIsWhatTheCovarianceSays) {
  expect_strict("rotation", all_.known.at(li), &Sample::rotation, 3);
  expect_strict("position", all_.known.at(li), &Sample::position, 3);
  expect_mean("velocity", all_.known.at(li), &Sample::velocity, 3);
}

TEST_F(Consistency, InAKnownWorldTheErrorOfKilIsWhatTheCovarianceSays) {
  expect_strict("rotation", all_.known.at(kil), &Sample::rotation, 3);
  expect_strict("position", all_.known.at(kil), &Sample::position, 3);
  expect_mean("velocity", all_.known.at(kil), &Sample::velocity, 3);
}

// Of velocity and tilt, on the legs alone.
void expect_as_good_as_known(const std::vector<Samples>& runs) {
  for (const auto& [name, part, degrees] : {std::tuple("velocity", &Sample::velocity, 3.0), std::tuple("tilt", &Sample::tilt, 2.0)}) {
    const double mean = Consistency::share(runs, part, 0, limits(degrees, runs.size()).high).mean / degrees;
    testing::Test::RecordProperty(name, std::to_string(mean));
    EXPECT_GT(mean, 0.4) << name;
    EXPECT_LT(mean, 2.0) << name;
  }
}

// The noise of the soles is learnt while the robot walks, with a floor: on soles that do not move at all the covariance stays the larger.
TEST_F(Consistency, OnLegsOfKnownNoiseVelocityAndTiltAreAsGoodAsTheCovarianceSays) { expect_as_good_as_known(all_.rigid); }

// With the noise that is shipped only from above: what a standing foot of a real robot does, settle, bend and roll, on any floor, is in it,
// and a simulated sole on a rigid floor does none of that.
TEST_F(Consistency, OnTheLegsAloneVelocityAndTiltAreNotBelievedMoreThanTheyAreKnown) {
  const std::vector<Samples>& runs = all_.runs.at(ki);
  const Share velocity = share(runs, &Sample::velocity, 0, limits(3, runs.size()).high);
  const Share tilt = share(runs, &Sample::tilt, 0, limits(2, runs.size()).high);
  testing::Test::RecordProperty("velocity", std::to_string(velocity.mean));
  testing::Test::RecordProperty("tilt", std::to_string(tilt.mean));
  EXPECT_GE(velocity.inside, 0.9) << "mean NEES of velocity " << velocity.mean;
  EXPECT_GE(tilt.inside, 0.9) << "mean NEES of tilt " << tilt.mean;
}

// Encoders with other zeros, links of other lengths, soles that give way: what no density of the noise has.
TEST_F(Consistency, OnWornLegsAloneVelocityAndTiltAreAsGoodAsTheCovarianceSays) { expect_as_good_as_known(all_.worn); }

}  // namespace walk_test
}  // namespace kilvo
