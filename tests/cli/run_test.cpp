// kilvo run, when all is well, and what its options do.
#include <csignal>
#include <sstream>

#include "lab/mapping/ply.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace run_test {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

class Run : public Story {
 protected:
  void SetUp() override {
    Story::SetUp();
    walk = small_walk();
    record(walk.measurements);
  }
  std::vector<std::string> lines(const std::string& file) const {
    std::istringstream in(read_text(folder / ("out/" + file)));
    std::vector<std::string> out;
    for (std::string line; std::getline(in, line);) out.push_back(line);
    return out;
  }
  SmallWalk walk;
};

TEST_F(Run, WritesTrajectoryMapAndSummary) {
  const Finished f = run();
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("configuration " + config()));
  EXPECT_THAT(f.err, HasSubstr("point time"));

  const auto odometry = lab::read_tum(folder / "out/odometry.tum");
  EXPECT_GT(odometry.size(), 790);  // the IMU's rate
  const lab::Evaluation e = errors(walk.truth);
  EXPECT_GE(e.estimates, 39);  // of 40 scans
  EXPECT_LT(e.ate_rmse_m, 0.01);
  EXPECT_LT(e.rotation_rmse_deg, 0.3);
  EXPECT_LT(errors(walk.truth, "odometry.tum").ate_rmse_m, 0.01);

  EXPECT_EQ(lines("states.csv").front(),
            "t,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz,gx,gy,gz,tau,pclx,pcly,pclz,pcrx,pcry,pcrz,spx,spy,spz,srx,sry,srz");
  EXPECT_EQ(lines("states.csv").size(), e.estimates + 1);
  EXPECT_THAT(lines("modality.csv"), testing::ElementsAre("t,modality,cause", StartsWith("1700000000.")));
  EXPECT_THAT(lines("modality.csv")[1], HasSubstr(",LI,start"));
  EXPECT_EQ(lines("timing.csv").size(), 3 * e.estimates + 1);
  EXPECT_GT(lab::read_ply(folder / "out/map.ply").size(), 5000);
  EXPECT_FALSE(fs::exists(folder / "out/contacts.csv"));  // no legs
}

TEST_F(Run, TheSummarySaysWhatHappened) {
  ASSERT_EQ(run({"--set", "lidar.gate=4"}).code, 0);
  const auto s = summary();
  EXPECT_EQ(s["version"], "0.1.0");
  EXPECT_EQ(s["input"], recording());
  EXPECT_EQ(s["config_file"], config());
  EXPECT_EQ(s["config"]["lidar"]["gate"], 4);
  EXPECT_EQ(s["config"]["lidar"]["topic"], "/points");
  EXPECT_EQ(s["failure"], nullptr);
  EXPECT_EQ(s["diverged"], false);
  EXPECT_EQ(s["input_damaged"], false);
  EXPECT_EQ(s["warnings"].size(), 0);
  EXPECT_GE(s["messages"]["lidar"]["used"], 39);
  EXPECT_EQ(s["messages"]["imu"]["dropped"], nlohmann::json::object());
  EXPECT_NEAR(s["modality_seconds"]["LI"], 4, 0.1);
  EXPECT_NEAR(s["path_length_m"], errors(walk.truth).path_length_m, 0.05);
  EXPECT_EQ(s["first_pose"]["p"], nlohmann::json({0.0, 0.0, 0.0}));
  EXPECT_EQ(s["last_pose"]["q_xyzw"].size(), 4);
  EXPECT_NEAR(s["start_to_end_m"], (walk.truth.back().T.p - walk.truth.front().T.p).norm(), 0.02);
  EXPECT_GT(s["stage_us"]["lidar"]["p99"], s["stage_us"]["lidar"]["p50"]);
  EXPECT_EQ(s["stage_us"]["map"]["n"], s["sweeps"]);
  EXPECT_GT(s["mean_ms_per_frame"], 0);
  EXPECT_GT(s["real_time_factor"], 0);
  EXPECT_GT(s["peak_memory_mb"], 1);
}

TEST_F(Run, TheResultDoesNotDependOnTheRunNorOnTheThreads) {
  std::string odometry, map;
  for (const char* threads : {"1", "1", "2", "4"}) {
    ASSERT_EQ(run({"--threads", threads, "--quiet"}).code, 0);
    if (odometry.empty()) {
      odometry = read_text(folder / "out/odometry.tum");
      map = read_text(folder / "out/map.ply");
      ASSERT_GT(odometry.size(), 10000);
      ASSERT_GT(map.size(), 10000);
    }
    EXPECT_TRUE(odometry == read_text(folder / "out/odometry.tum")) << threads;
    EXPECT_TRUE(map == read_text(folder / "out/map.ply")) << threads;
  }
}

TEST_F(Run, QuietSaysNothingWhenAllIsWell) {
  const Finished f = run({"--quiet"});
  EXPECT_EQ(f.code, 0);
  EXPECT_EQ(f.err, "");
  EXPECT_EQ(f.out, "");
}

TEST_F(Run, TheImuAloneCoasts) {
  const Finished f = run({"--sensors", "imu"});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(lines("modality.csv")[1], HasSubstr(",COAST,start"));
  EXPECT_EQ(lines("sweeps.tum").size(), 0);
  EXPECT_NEAR(static_cast<double>(lines("states.csv").size()), 200, 4);  // 50 Hz
  EXPECT_LT(errors(walk.truth, "odometry.tum").ate_rmse_m, 1.0);
  EXPECT_FALSE(summary()["messages"].contains("lidar"));
}

// It stands for 1.5 s; and without the IMU there are no outputs.
TEST_F(Run, ARobotThatStandsOrAGapOfTheImuIsNotUnmeasured) {
  const Finished stands = run({"--sensors", "imu,lidar", "--drop", "lidar:0-1.3", "--duration", "2"});
  EXPECT_EQ(stands.code, 0) << stands.err;
  const Finished paused = run({"--drop", "imu:0.7-2.2", "--drop", "lidar:0.7-2.2", "--duration", "2.6"});
  EXPECT_EQ(paused.code, 0) << paused.err;
}

// A LiDAR that comes back finds the robot in its map; at the end of a recording nothing does.
TEST_F(Run, AnEndThatNothingMeasuresIsAFailureAndALossBeforeIsAWarning) {
  const SmallWalk longer = small_walk(12);
  record(longer.measurements);
  const Finished bridged = run({"--drop", "lidar:6-8.5"});
  EXPECT_EQ(bridged.code, 0) << bridged.err;
  EXPECT_THAT(bridged.err, HasSubstr("neither LiDAR nor legs measured the motion"));
  const Finished ended = run({"--drop", "lidar:7.5-"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_THAT(ended.err,
              HasSubstr("s neither LiDAR nor legs measured the motion: the positions of that time are integrated from the IMU alone "
                        "(--duration leaves them out)"));
  EXPECT_EQ(run({"--drop", "lidar:7.5-", "--duration", "7.5"}).code, 0);
}

TEST_F(Run, ALossThatIsAskedForAndMeetsNothingIsReported) {
  const Finished f = run({"--drop", "lidar:100-200", "--drop", "camera:1-2", "--drop", "lidar:2-2.3", "--duration", "3"});
  EXPECT_THAT(f.err, testing::AllOf(HasSubstr("--drop lidar:100-200: without effect, no message of the lidar came in that time"),
                                    HasSubstr("--drop camera:1-2: without effect, the camera is not used"),
                                    testing::Not(HasSubstr("lidar:2-2.3: without"))));
}

TEST_F(Run, DroppedScansAreCountedAndBridged) {
  ASSERT_EQ(run({"--drop", "lidar:2-3", "--drop", "lidar:3.75-"}).code, 0);
  const auto lidar = summary()["messages"]["lidar"];
  EXPECT_NEAR(lidar["dropped"]["drop_option"], 12, 2);
  EXPECT_EQ(errors(walk.truth).estimates, lidar["used"]);
  EXPECT_NEAR(lidar["used"], 28, 2);
  EXPECT_LT(errors(walk.truth, "odometry.tum").largest_gap_s, 0.01);
  EXPECT_LT(errors(walk.truth).ate_max_m, 0.1);
}

TEST_F(Run, DegradedScansShowLess) {
  ASSERT_EQ(run().code, 0);
  const double whole = summary()["points"]["in_map"];
  ASSERT_EQ(run({"--degrade", "narrow:0.5-"}).code, 0);
  EXPECT_LT(summary()["points"]["in_map"], 0.7 * whole);
  EXPECT_EQ(summary()["messages"]["lidar"]["dropped"].count("drop_option"), 0U);
}

TEST_F(Run, APartOfTheRecordingCanBeChosen) {
  ASSERT_EQ(run({"--start", "0.5", "--duration", "2"}).code, 0);
  const auto odometry = lab::read_tum(folder / "out/odometry.tum");
  EXPECT_NEAR(to_seconds(odometry.front().t - walk.truth.front().t), 0.5, 0.02);
  EXPECT_NEAR(to_seconds(odometry.back().t - walk.truth.front().t), 2.5, 0.02);
}

TEST_F(Run, TheMapMayGoElsewhereOrNowhere) {
  ASSERT_EQ(run({"--map", folder / "elsewhere.ply"}).code, 0);
  EXPECT_TRUE(fs::exists(folder / "elsewhere.ply"));
  EXPECT_FALSE(fs::exists(folder / "out/map.ply"));
  ASSERT_EQ(run({"--no-map"}).code, 0);
  EXPECT_FALSE(fs::exists(folder / "out/map.ply"));
  ASSERT_EQ(run({"--set", "map.resolution=0.5"}).code, 0);
  const std::size_t coarse = lab::read_ply(folder / "out/map.ply").size();
  EXPECT_LT(3 * coarse, lab::read_ply(folder / "elsewhere.ply").size());
}

TEST_F(Run, AFolderWithARecordingIsAnInputAndBringsItsConfiguration) {
  fs::create_directories(folder / "sim");
  fs::rename(recording(), folder / "sim/recording.bag");
  fs::rename(config(), folder / "sim/config.yaml");
  const Finished f = kilvo({"run", folder / "sim", "--out", out()});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr(folder / "sim/config.yaml"));
}

TEST_F(Run, TheWorldMayBeTheFirstImuFrame) {
  ASSERT_EQ(run({"--set", "estimator.gravity_align=false"}).code, 0);
  const Eigen::Quaterniond q = lab::read_tum(folder / "out/odometry.tum").front().T.R.quaternion();
  EXPECT_LT(q.vec().norm(), 1e-3);
}

TEST_F(Run, ResultsOfAnEarlierRunAreReplaced) {
  // In the frame of the first sample: a world that is levelled by all that is known at the end depends on the length of the run.
  ASSERT_EQ(run({"--set", "estimator.gravity_align=false"}).code, 0);
  const std::string before = read_text(folder / "out/odometry.tum");
  ASSERT_EQ(run({"--duration", "2", "--set", "estimator.gravity_align=false"}).code, 0);
  EXPECT_LT(read_text(folder / "out/odometry.tum").size(), before.size());
  EXPECT_EQ(before.substr(0, 1000), read_text(folder / "out/odometry.tum").substr(0, 1000));
}

TEST_F(Run, CtrlCWritesWhatIsThere) {
  constexpr std::int64_t samples = 400000, period_ns = 5'000'000;
  std::vector<Measurement> long_rest;
  long_rest.reserve(samples);
  for (std::int64_t i = 0; i < samples; ++i)
    long_rest.emplace_back(ImuSample{walk.truth.front().t + Duration(i * period_ns), {0, 0, 0}, {0, 0, 9.8}});
  record(long_rest);
  Started program({"run", recording(), "--config", config(), "--out", out(), "--sensors", "imu"});
  wait_for_content(folder / "out/odometry.tum");
  program.send(SIGINT);
  const Finished f = program.wait();
  EXPECT_EQ(f.code, 1) << f.err;
  EXPECT_THAT(f.err, HasSubstr("kilvo: error: stopped by the user"));
  EXPECT_EQ(summary()["failure"], "stopped by the user");
  const std::size_t poses = lab::read_tum(folder / "out/odometry.tum").size();
  EXPECT_GT(poses, 0);
  EXPECT_LT(poses, 399000);
}

}  // namespace run_test
}  // namespace kilvo::stories
