// Encoders without a trustworthy clock whose messages come half a second after the IMU's of the same time.
#include "lab/recordings/recording_writer.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace late_legs_test {

using testing::HasSubstr;
using testing::Not;

class LateLegs : public Story {
 protected:
  void SetUp() override {
    lab::SimulatorConfig robot;
    robot.use = {true, true, false, false};
    robot.duration = 16;
    const auto& all = lab::scenarios();
    lab::Simulator simulator(*std::ranges::find(all, "room", &lab::Scenario::name), robot);
    std::vector<std::pair<Time, Measurement>> arrived;
    while (auto m = simulator.next()) {
      auto* joints = std::get_if<JointSample>(&*m);
      const Time at = simulator.arrived() + (joints != nullptr ? half_a_second : Duration(0));
      if (joints != nullptr) joints->t = at;
      arrived.emplace_back(at, *std::move(m));
    }
    std::ranges::stable_sort(arrived, {}, &std::pair<Time, Measurement>::first);
    lab::RecordingWriter writer(recording(), lab::simulated_topics());
    for (const auto& [at, m] : arrived) writer.write(m, at);
    writer.close();
    for (double t = 0; t < robot.duration; t += 0.01) truth.push_back({simulator.start() + from_seconds(t), simulator.walk().imu(t)});
    write_text(config(), lab::simulated_config(robot, KILVO_SOURCE_DIR "/config/robots/sim.urdf"));
  }

  static constexpr Duration half_a_second = std::chrono::milliseconds(500);
  std::vector<lab::StampedPose> truth;
};

TEST_F(LateLegs, AreWaitedForInARecordingWhenTheirTimeIsLookedFor) {
  const Finished f = run({"--sensors", "imu,legs", "--set", "legs.clock=estimated", "--quiet", "--no-map"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("clock by comparison with the IMU: -50"));
  EXPECT_THAT(f.err, Not(HasSubstr("could not be used: late")));
  EXPECT_LT(errors(truth, "odometry.tum").ate_rmse_m, 0.05);
}

}  // namespace late_legs_test
}  // namespace kilvo::stories
