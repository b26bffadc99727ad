// A robot whose legs have a controller each, which publish by another clock than the IMU's.
#include "lab/recordings/recording_writer.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace other_clocks_test {

using testing::HasSubstr;

class OtherClocks : public Story {
 protected:
  void SetUp() override {
    lab::SimulatorConfig robot;
    robot.use = {true, true, false, false};
    robot.duration = 8;
    const auto& all = lab::scenarios();
    lab::Simulator simulator(*std::ranges::find(all, "room", &lab::Scenario::name), robot);
    lab::RecordingWriter writer(recording(), lab::simulated_topics());
    while (const auto m = simulator.next()) {
      const auto* joints = std::get_if<JointSample>(&*m);
      if (joints == nullptr) writer.write(*m, simulator.arrived());
      if (joints == nullptr) continue;
      for (const char* side : {"left", "right"}) writer.write(part(*joints, side), simulator.arrived());
    }
    writer.close();
    for (double t = 0; t < robot.duration; t += 0.01) truth.push_back({simulator.start() + from_seconds(t), simulator.walk().imu(t)});
    write_text(config(), lab::simulated_config(robot, KILVO_SOURCE_DIR "/config/robots/sim.urdf"));
  }

  /// The joints of one side (and with the left one the waist), stamped with the time since some boot.
  static JointSample part(const JointSample& all, const std::string& side) {
    JointSample out{all.t - years, {}, {}, {}, {}};
    JointNames::List names;
    for (std::size_t i = 0; i < all.names.size(); ++i) {
      if (all.names[i].starts_with("right") != (side == "right")) continue;
      names.push_back(all.names[i]);
      out.position.push_back(all.position[i]);
      out.velocity.push_back(all.velocity[i]);
    }
    out.names = names;
    return out;
  }

  static constexpr Duration years = std::chrono::hours(24 * 365 * 50);
  std::vector<lab::StampedPose> truth;
};

TEST_F(OtherClocks, OfLegsInPartsCostNothing) {
  const Finished f = run({"--sensors", "imu,legs", "--quiet", "--no-map"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("legs: its stamps are of another clock than the IMU's"));
  EXPECT_NEAR(summary()["messages"]["legs"]["clock_moved_s"].get<double>(), to_seconds(years), 0.005);
  EXPECT_GT(summary()["messages"]["legs"]["used"].get<int>(), 7900);
  EXPECT_LT(errors(truth, "odometry.tum").ate_rmse_m, 0.01);
}

}  // namespace other_clocks_test
}  // namespace kilvo::stories
