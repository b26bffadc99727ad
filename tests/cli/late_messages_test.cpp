// Messages that come long after those of the IMU of the same time, or before them: a recording over a network, encoders without a clock.
#include <functional>

#include "lab/recordings/recording_writer.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace late_messages_test {

using testing::HasSubstr;
using testing::Not;

class LateMessages : public Story {
 protected:
  // `late`: by so much later a message is recorded than it arrived; it may change its stamp.
  void record(std::array<bool, sensor_count> use, double seconds, const std::function<Duration(Measurement&, Time)>& late) {
    lab::SimulatorConfig robot;
    robot.use = use;
    robot.duration = seconds;
    const auto& all = lab::scenarios();
    lab::Simulator simulator(*std::ranges::find(all, "room", &lab::Scenario::name), robot);
    std::vector<std::pair<Time, Measurement>> arrived;
    while (auto m = simulator.next()) {
      const Time at = simulator.arrived() + late(*m, simulator.arrived());
      arrived.emplace_back(at, *std::move(m));
    }
    std::ranges::stable_sort(arrived, {}, &std::pair<Time, Measurement>::first);
    lab::RecordingWriter writer(recording(), lab::simulated_topics());
    for (const auto& [at, m] : arrived) writer.write(m, at);
    writer.close();
    for (double t = 0; t < robot.duration; t += 0.01) truth.push_back({simulator.start() + from_seconds(t), simulator.walk().imu(t)});
    write_text(config(), lab::simulated_config(robot, KILVO_SOURCE_DIR "/config/robots/sim.urdf"));
  }
  void record_late(Sensor sensor, double seconds) {
    record({true, false, true, false}, 8,
           [=](const Measurement& m, Time) { return sensor_of(m) == sensor ? from_seconds(seconds) : Duration(0); });
  }

  std::vector<lab::StampedPose> truth;
};

TEST_F(LateMessages, LegsAreWaitedForInARecordingWhenTheirTimeIsLookedFor) {
  record({true, true, false, false}, 16, [](Measurement& m, Time arrived) {
    const Duration half_a_second = std::chrono::milliseconds(500);
    auto* joints = std::get_if<JointSample>(&m);
    if (joints == nullptr) return Duration(0);
    joints->t = arrived + half_a_second;
    return half_a_second;
  });
  const Finished f = run({"--sensors", "imu,legs", "--set", "legs.clock=estimated", "--quiet", "--no-map"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("clock by comparison with the IMU: -50"));
  EXPECT_THAT(f.err, Not(HasSubstr("could not be used: late")));
  EXPECT_LT(errors(truth, "odometry.tum").ate_rmse_m, 0.05);
}

TEST_F(LateMessages, OfTheLidarAreWaitedForInARecording) {
  record_late(Sensor::lidar, 0.4);
  const Finished f = run({"--sensors", "imu,lidar", "--quiet", "--no-map"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, Not(HasSubstr("could not be used")));
  EXPECT_LT(errors(truth, "odometry.tum").ate_rmse_m, 0.003);
}

// Or its clock is behind: who is right is not known, and nothing measures the motion.
TEST_F(LateMessages, OfTheImuLeaveNoTrajectory) {
  record_late(Sensor::imu, 0.3);
  const Finished f = run({"--sensors", "imu,lidar", "--quiet", "--no-map"});
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("neither LiDAR nor legs measured the motion"));
}

}  // namespace late_messages_test
}  // namespace kilvo::stories
