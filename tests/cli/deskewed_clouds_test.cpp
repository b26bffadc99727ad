// Clouds that the driver has deskewed already, with the points' times left in the message: kilvo corrects the configuration by itself.
#include "lab/recordings/recording_writer.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/scenarios.hpp"
#include "lab/simulation/simulator.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace deskewed_clouds_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class DeskewedClouds : public Story {
 protected:
  /// 16 s in a room; all points of a cloud are where the LiDAR is so long after the stamp.
  void record_deskewed_to(Duration after) {
    walked_.clear();
    lab::SimulatorConfig simulated;
    simulated.duration = 16;
    simulated.use = {true, false, true, false};
    simulated.lidar.points = 8000;
    const std::vector<lab::Scenario> all = lab::scenarios();
    lab::Simulator simulator(*std::ranges::find(all, "room", &lab::Scenario::name), simulated);
    write_text(config(), lab::simulated_config(simulated, std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf"));
    const SE3 T_imu_lidar = lab::load_settings(config()).robot.lidar.T_imu_lidar;
    const auto lidar = [&](Time t) { return simulator.walk().imu(simulator.seconds_of(t)) * T_imu_lidar; };
    lab::RecordingWriter writer(recording(), lab::simulated_topics());
    while (auto measurement = simulator.next()) {
      if (auto* scan = std::get_if<LidarScan>(&*measurement)) {
        const SE3 back = lidar(scan->t + after).inverse();
        for (LidarPoint& point : scan->points) {
          const SE3 there = back * lidar(scan->t + Duration(point.offset_ns));
          const Eigen::Vector3f p = (there * Eigen::Vector3d(point.x, point.y, point.z)).cast<float>();
          point.x = p.x(), point.y = p.y(), point.z = p.z();
        }
      }
      writer.write(*measurement);
    }
    writer.close();
    for (Time t = simulator.start(); t < simulator.start() + from_seconds(16); t += std::chrono::milliseconds(1))
      walked_.push_back({t, simulator.walk().imu(simulator.seconds_of(t))});
  }

  Finished doctor(const std::string& file, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"doctor", recording(), "--config", file};
    words.insert(words.end(), more.begin(), more.end());
    return kilvo(words);
  }
  std::vector<std::string> quickly() const { return {"--sensors", "imu,lidar", "--quiet", "--no-map"}; }

  std::vector<lab::StampedPose> walked_;
};

TEST_F(DeskewedClouds, AreReadAsSuchAfterARestart) {
  for (const int after : {0, 100}) {
    record_deskewed_to(std::chrono::milliseconds(after));
    const Finished f = run(quickly());
    EXPECT_EQ(f.code, 1) << "as with other descriptions that were wrong";
    EXPECT_THAT(f.err, AllOf(HasSubstr("the clouds are motion-compensated already"), HasSubstr("; the results are with lidar.deskew"),
                             HasSubstr("warning: restarted with lidar.deskew: false"), Not(HasSubstr("have the same time"))));
    EXPECT_LT(errors(walked_).ate_rmse_m, 0.004) << after;
  }
}

TEST_F(DeskewedClouds, AreReadAsSuchWithWhatTheDoctorWrites) {
  record_deskewed_to(std::chrono::milliseconds(50));
  const std::string better = folder / "better.yaml";
  EXPECT_EQ(doctor(config(), {"--write", better}).code, 1);
  EXPECT_THAT(read_text(better), AllOf(HasSubstr("deskew: false"), HasSubstr("time_offset: 0.05")));
  const Finished again = doctor(better);
  EXPECT_EQ(again.code, 0) << again.out;
  EXPECT_THAT(again.out, HasSubstr("each cloud is taken at its stamp"));
  const Finished f = kilvo({"run", recording(), "--config", better, "--out", out(), "--sensors", "imu,lidar", "--quiet", "--no-map"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_LT(errors(walked_).ate_rmse_m, 0.004);
  // The option of the command line is the same.
  const std::string by_setting = read_text(folder / "out/sweeps.tum");
  const Finished option = kilvo({"run", recording(), "--config", better, "--set", "lidar.deskew=true", "--no-deskew", "--out", out(),
                                 "--sensors", "imu,lidar", "--quiet", "--no-map"});
  EXPECT_EQ(option.code, 0) << option.err;
  EXPECT_EQ(read_text(folder / "out/sweeps.tum"), by_setting);
}

}  // namespace deskewed_clouds_test
}  // namespace kilvo::stories
