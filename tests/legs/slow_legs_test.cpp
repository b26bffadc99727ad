// A humanoid whose encoders and IMU speak at 100 Hz, noisily, and that has nothing else: a metre of walking on the legs alone.
#include <algorithm>
#include <gtest/gtest.h>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo {
namespace slow_legs_test {

lab::SimulatorConfig slow_robot(std::uint64_t seed) {
  lab::SimulatorConfig config;
  config.seed = seed;
  config.use = {true, true, false, false};
  config.imu.delivery.rate = config.joints.delivery.rate = 100;
  config.imu.gyro_noise = 1e-3;  // rad/s/sqrt(Hz)
  config.imu.accel_noise = 5e-3;
  config.joints.position_noise = 5e-4;  // rad
  config.joints.velocity_noise = 0.04;  // rad/s
  return config;
}

// Stands, walks a metre, stands.
lab::Scenario a_metre() {
  lab::Scenario out{"a_metre", "", "room", {-2.2, -1.3, 0}, {}};
  lab::Gait gait;
  gait.forward = 0.15;
  out.stages = {{.stand = 3.4}, {.steps = 7, .gait = gait}, {.stand = 1}};
  return out;
}

TEST(SlowLegs, AMetreAtAHundredHertzEndsWithinFiveCentimetres) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const lab::SimulatorConfig config = slow_robot(seed);
    lab::Simulator simulator(a_metre(), config);
    lab::Settings settings =
        lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
    settings.robot.imu.rate = settings.robot.legs.rate = 100;
    Estimator estimator(settings.robot, settings.estimator, config.use);
    std::vector<Output> outputs;
    while (auto m = simulator.next()) estimator.push(*std::move(m), outputs);
    ASSERT_FALSE(outputs.empty());
    const auto truth = [&](const Output& o) { return simulator.walk().imu(simulator.seconds_of(o.t)); };
    const SE3 T_WR = outputs.front().x.pose() * truth(outputs.front()).inverse();
    const SE3 moved = truth(outputs.front()).inverse() * truth(outputs.back());
    EXPECT_GT(moved.p.norm(), 0.8);
    EXPECT_LT(((T_WR * truth(outputs.back())).p - outputs.back().x.p).norm(), 0.05);
    EXPECT_EQ(estimator.statistics().lost_stances, 0u);
    int lifts = 0;
    for (std::size_t i = 1; i < outputs.size(); ++i) {
      if (!outputs[i].contacts || !outputs[i - 1].contacts) continue;
      for (std::size_t side = 0; side < 2; ++side) lifts += outputs[i - 1].contacts->on[side] && !outputs[i].contacts->on[side] ? 1 : 0;
    }
    EXPECT_NEAR(lifts, 8, 2) << "steps that were seen";
  }
}

}  // namespace slow_legs_test
}  // namespace kilvo
