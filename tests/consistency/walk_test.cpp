// Is the error of a walking humanoid's estimate as large as the covariance says? Over seeds, in each modality.
// KILVO_SEEDS and KILVO_SECONDS make it a benchmark: KILVO_SEEDS=50 KILVO_SECONDS=20 kilvo_consistency_test
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <map>
#include <memory>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo {
namespace {

double number_of(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::atof(text) : otherwise;
}

const lab::Scenario& scenario_named(const std::string& name) { return *std::ranges::find(lab::scenarios(), name, &lab::Scenario::name); }

/// Of one output: squared error in units of the covariance, per part.
struct Sample {
  double pose = 0;          // 6 degrees of freedom
  double velocity = 0;      // 3
  double tilt = 0;          // 2: roll and pitch
  double worst_sigmas = 0;  // of the three components of position
  double sigma = 0;         // of position, m
};
using Samples = std::vector<Sample>;  // by tenth of a second after the start

/// One simulated walk, estimated by some of its sensors.
class Walk {
 public:
  Walk(std::uint64_t seed, double seconds) {
    lab::SimulatorConfig config;
    config.seed = seed;
    config.duration = seconds;
    config.use[static_cast<std::size_t>(Sensor::camera)] = false;
    config.threads = 2;
    simulator_ = std::make_unique<lab::Simulator>(scenario_named("room"), config);
    while (auto m = simulator_->next()) measurements_.push_back(*std::move(m));
    settings_ =
        lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
  }

  Samples estimated_by(std::array<bool, sensor_count> used) const {
    Estimator estimator(settings_.robot, settings_.estimator, used);
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

 private:
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
    out.velocity = dv.dot(o.P.block<3, 3>(at::v, at::v).ldlt().solve(dv));
    out.tilt = tilt.dot(T.ldlt().solve(tilt));
    out.worst_sigmas = (e.tail<3>().array().abs() / P.diagonal().tail<3>().array().sqrt()).maxCoeff();
    out.sigma = std::sqrt(P.diagonal().tail<3>().maxCoeff());
    return out;
  }

  std::unique_ptr<lab::Simulator> simulator_;
  std::vector<Measurement> measurements_;
  lab::Settings settings_;
};

constexpr std::array<bool, sensor_count> li = {true, false, true, false}, kil = {true, true, true, false}, ki = {true, true, false, false};

class Consistency : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto seeds = static_cast<std::uint64_t>(number_of("KILVO_SEEDS", 10));
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const Walk walk(seed, number_of("KILVO_SECONDS", 8));
      for (auto& [used, runs] : runs_) runs.push_back(walk.estimated_by(used));
    }
  }
  static void TearDownTestSuite() { runs_.clear(); }

  /// The mean over the runs at each time, and the share of times at which it is within [low, high].
  struct Share {
    double inside = 0, mean = 0;
  };
  static Share share(const std::array<bool, sensor_count>& used, double Sample::*part, double low, double high) {
    const std::vector<Samples>& runs = runs_.at(used);
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

  static std::map<std::array<bool, sensor_count>, std::vector<Samples>> runs_;
};

std::map<std::array<bool, sensor_count>, std::vector<Samples>> Consistency::runs_ = {{li, {}}, {kil, {}}, {ki, {}}};

TEST_F(Consistency, WithItsOwnMapTheErrorOfLiIsAsLargeAsTheCovarianceSays) {
  const Share pose = share(li, &Sample::pose, 0.4 * 6, 2.0 * 6);
  EXPECT_GE(pose.inside, 0.9) << "mean NEES per degree of freedom " << pose.mean / 6;
}

TEST_F(Consistency, WithItsOwnMapTheErrorOfKilIsAsLargeAsTheCovarianceSays) {
  const Share pose = share(kil, &Sample::pose, 0.4 * 6, 2.0 * 6);
  EXPECT_GE(pose.inside, 0.9) << "mean NEES per degree of freedom " << pose.mean / 6;
}

// Yaw, position and height cannot be observed from the legs: their uncertainty grows, and the error stays inside three of it.
TEST_F(Consistency, OnTheLegsAloneTheErrorStaysInsideAGrowingUncertainty) {
  int outside = 0, all = 0;
  for (const Samples& run : runs_.at(ki)) {
    for (const Sample& s : run) {
      outside += s.worst_sigmas > 3 ? 1 : 0;
      ++all;
    }
    EXPECT_GT(run.back().sigma, 2 * run.front().sigma);
  }
  EXPECT_LE(outside, all / 50) << "of " << all;
}

// The upper 97.5 % limit of the mean over n runs of a chi-square value with k degrees of freedom (Wilson and Hilferty).
double upper_limit(double k, double n) {
  const double spread = 2.0 / (9 * k * n);
  return k * std::pow(1 - spread + 1.96 * std::sqrt(spread), 3);
}

TEST_F(Consistency, OnTheLegsAloneVelocityAndTiltAreNotBelievedMoreThanTheyAreKnown) {
  const auto runs = static_cast<double>(runs_.at(ki).size());
  const Share velocity = share(ki, &Sample::velocity, 0, upper_limit(3, runs)), tilt = share(ki, &Sample::tilt, 0, upper_limit(2, runs));
  EXPECT_GE(velocity.inside, 0.9) << "mean NEES of velocity " << velocity.mean;
  EXPECT_GE(tilt.inside, 0.9) << "mean NEES of tilt " << tilt.mean;
}

}  // namespace
}  // namespace kilvo
