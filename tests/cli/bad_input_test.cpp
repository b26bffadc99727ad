// Recordings, configurations and folders that are not as they should be.
#include <cmath>
#include <limits>
#include <random>

#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace bad_input_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr double nan_d = std::numeric_limits<double>::quiet_NaN();

class BadInput : public Story {
 protected:
  /// The program prints as many lines as there are mistakes and ends with `code`; nothing of a run is left behind.
  void expect_refused(const Finished& f, int code, const std::string& text, int lines = 1) const {
    EXPECT_EQ(f.code, code) << f.err;
    EXPECT_THAT(f.err, AllOf(StartsWith("kilvo: error: "), HasSubstr(text)));
    EXPECT_EQ(std::count(f.err.begin(), f.err.end(), '\n'), lines) << f.err;
    EXPECT_FALSE(fs::exists(folder / "out/odometry.tum"));
  }
  void expect_finite_and_sorted() const {
    const auto poses = lab::read_tum(folder / "out/odometry.tum");  // throws on non-finite numbers and on time going back
    EXPECT_GT(poses.size(), 100);
  }
};

TEST_F(BadInput, FilesThatAreNoRecording) {
  expect_refused(run(), 3, "recording.bag");  // not there
  write_text(recording(), "");
  expect_refused(run(), 3, "recording.bag");
  write_text(recording(), "Dear bag, this is a letter.\n");
  expect_refused(run(), 3, "recording.bag");
  write_text(recording(), "#ROSBAG V1.2\n");
  expect_refused(run(), 3, "recording.bag");
  expect_refused(kilvo({"run", folder.path().string(), "--config", config(), "--out", out()}), 3, "recording.bag");
  write_text(folder / "x.mcap", "\x89MCAP0\r\n");
  expect_refused(kilvo({"run", folder / "x.mcap", "--config", config(), "--out", out()}), 3, "holds no messages");
  write_text(folder / "x.db3", std::string("SQLite format 3\0 and no more", 29));
  expect_refused(kilvo({"run", folder / "x.db3", "--config", config(), "--out", out()}), 3, "a SQLite database, but not of rosbag2");
}

TEST_F(BadInput, AnEmptyBag) {
  record({});
  expect_refused(run(), 3, "recording.bag");
  expect_refused(run({"--sensors", "imu"}), 3, "recording.bag");
}

TEST_F(BadInput, AStartBehindTheEnd) {
  record(small_walk(2).measurements);
  expect_refused(run({"--start", "50"}), 3, "recording.bag: ends after ");
}

TEST_F(BadInput, AWrongTopicNamesTheNearest) {
  record(small_walk(2).measurements);
  expect_refused(run({"--sensors", "imu,lidar", "--set", "lidar.topic=/point"}), 3, "/points");
  expect_refused(run({"--sensors", "imu,lidar", "--set", "imu.topic=/imv"}), 3, "/imu");
  expect_refused(run({"--set", "imu.topic=/imv"}), 3, "nearest is /imu");
  expect_refused(run({"--set", "lidar.topic=/point"}), 3, "nearest is /points");  // no LiDAR, no legs
  expect_refused(run({"--set", "lidar.topic=/point", "--set", "imu.topic=/imv"}), 3, "none of the topics");
}

TEST_F(BadInput, AMisspeltTopicIsNoAbsentSensor) {
  record(small_walk(2).measurements);
  write_text(folder / "legs_too.yaml", small_config() + "legs: {topic: /joints}\n");
  expect_refused(run({"--set", "lidar.topic=/point"}), 3, "/points is of that kind: --set lidar.topic=/points");
  // No message in it could be of legs: they are not there, and the run goes on without them.
  EXPECT_THAT(kilvo({"run", recording(), "--config", folder / "legs_too.yaml", "--out", out()}).err, HasSubstr("no topic /joints (legs)"));
}

TEST_F(BadInput, ATopicOfAnotherType) {
  record(small_walk(2).measurements);
  expect_refused(run({"--sensors", "imu,lidar", "--set", "lidar.topic=/imu"}), 3, "sensor_msgs/Imu");
}

TEST_F(BadInput, CloudsWithoutPointTimesNeedNoDeskew) {
  SmallWalk walk = small_walk(3);
  for_each_scan(walk.measurements, [](LidarScan& scan, std::size_t) {
    for (LidarPoint& p : scan.points) p.offset_ns = 0;
  });
  record(walk.measurements);
  expect_refused(run(), 3, "--no-deskew");
  ASSERT_EQ(run({"--no-deskew"}).code, 0);
  EXPECT_LT(errors(walk.truth).ate_max_m, 0.1);
}

TEST_F(BadInput, NonFiniteNumbersAreCountedAndDoNoHarm) {
  SmallWalk walk = small_walk();
  for_each_scan(walk.measurements, [](LidarScan& scan, std::size_t i) {
    for (std::size_t k = i % 7; k < scan.points.size(); k += 7)
      scan.points[k].x = k % 2 == 0 ? nan_f : -std::numeric_limits<float>::infinity();
  });
  for_each_imu(walk.measurements, [](ImuSample& s, std::size_t i) {
    if (i % 50 == 20) s.gyro.x() = nan_d;
    if (i % 50 == 40) s.accel.z() = std::numeric_limits<double>::infinity();
  });
  record(walk.measurements);
  const Finished f = run();
  ASSERT_EQ(f.code, 0) << f.err;
  expect_finite_and_sorted();
  EXPECT_LT(errors(walk.truth).ate_rmse_m, 0.02);
  const auto s = summary();
  EXPECT_GT(s["points"]["non_finite"], 10000);
  std::size_t dropped = 0;
  for (const auto& [cause, n] : s["messages"]["imu"]["dropped"].items()) dropped += n.get<std::size_t>();
  EXPECT_NEAR(static_cast<double>(dropped), 32, 2) << s["messages"]["imu"]["dropped"];
}

TEST_F(BadInput, OneScanOfNothingButNanIsBridged) {
  SmallWalk walk = small_walk();
  for_each_scan(walk.measurements, [](LidarScan& scan, std::size_t i) {
    if (i != 20 && i != 25) return;
    if (i == 25) return scan.points.clear();
    for (LidarPoint& p : scan.points) p.x = p.y = p.z = nan_f;
  });
  record(walk.measurements);
  ASSERT_EQ(run().code, 0);
  expect_finite_and_sorted();
  EXPECT_LT(errors(walk.truth).ate_rmse_m, 0.02);
}

TEST_F(BadInput, AnImuThatGoesBackInTimeIsSortedOut) {
  SmallWalk walk = small_walk();
  for_each_imu(walk.measurements, [](ImuSample& s, std::size_t i) {
    if (i > 300 && i % 40 == 0) s.t -= std::chrono::milliseconds(700);
    if (i == 500) s.t = time_from_ns(5);
  });
  record(walk.measurements);
  const Finished f = run();
  ASSERT_EQ(f.code, 0) << f.err;
  expect_finite_and_sorted();
  EXPECT_LT(errors(walk.truth).ate_rmse_m, 0.05);
  EXPECT_GT(summary()["messages"]["imu"]["dropped"].size(), 0);
}

TEST_F(BadInput, HalfASecondWithoutImuIsBridged) {
  SmallWalk walk = small_walk(6);
  std::erase_if(walk.measurements, [&](const Measurement& m) {
    const double s = to_seconds(stamp_of(m) - walk.truth.front().t);
    return std::holds_alternative<ImuSample>(m) && s > 3 && s < 3.5;
  });
  record(walk.measurements);
  const Finished f = run();
  ASSERT_EQ(f.code, 0) << f.err;
  expect_finite_and_sorted();
  EXPECT_EQ(summary()["diverged"], false);
  EXPECT_LT(errors(walk.truth).ate_max_m, 0.3);
  EXPECT_LT(errors(walk.truth).e2e_m, 0.05);
}

TEST_F(BadInput, TooShortToStartIsAFailureThatTheSummaryExplains) {
  record(small_walk(0.3).measurements);
  const Finished f = run();
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("kilvo: error: nothing was estimated: still waiting for"));
  EXPECT_THAT(summary()["failure"], StartsWith("nothing was estimated"));
  for (const char* file : {"odometry.tum", "sweeps.tum", "states.csv", "modality.csv", "timing.csv", "map.ply"}) {
    EXPECT_TRUE(fs::exists(folder / ("out/" + std::string(file)))) << file;
  }
}

TEST_F(BadInput, ATruncatedRecordingIsRunAsFarAsItIsGood) {
  const SmallWalk walk = small_walk();
  record(walk.measurements);
  fs::resize_file(recording(), fs::file_size(recording()) * 3 / 4);
  const Finished f = run();
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("damaged at byte"));
  EXPECT_EQ(summary()["input_damaged"], true);
  EXPECT_EQ(summary()["warnings"].size(), 1);
  EXPECT_NEAR(static_cast<double>(errors(walk.truth).estimates), 30, 4);
}

TEST_F(BadInput, RandomDamageNeverCrashes) {
  record(small_walk(2.5).measurements);
  const std::string good = read_text(recording());
  std::mt19937 random(7);
  for (int i = 0; i < 24; ++i) {
    std::string bad = good;
    if (i % 2 == 0) bad.resize(random() % good.size());
    for (int k = 0; k < 20; ++k) bad[random() % bad.size()] ^= static_cast<char>(1 << random() % 8);
    write_text(recording(), bad);
    const Finished f = run({"--quiet"});
    EXPECT_TRUE(f.code == 0 || f.code == 1 || f.code == 3) << i << ": " << f.code << " " << f.err;
    if (f.code != 3) lab::read_tum(folder / "out/odometry.tum");  // throws on numbers that are not finite
  }
}

TEST_F(BadInput, AConfigurationErrorNamesFileLineKeyAndTheNearest) {
  record(small_walk(1).measurements);
  write_text(config(), small_config() + "  voxel_sise: 0.2\n");
  expect_refused(run(), 2, config() + ":8: lidar.voxel_sise: no such setting, nearest is lidar.voxel_size");
  write_text(config(), small_config() + "  voxel_size: small\n");
  expect_refused(run(), 2, config() + ":8: lidar.voxel_size: must be a number, not 'small'");
  write_text(config(),
             "imu: {topic: /imu}\nlidar:\n  topic: /points\n  T_imu_lidar:\n    p: [0, 0, 0]\n    R: [1, 0, 0, 0, 1, 0, 0, 0, 2]\n");
  expect_refused(run(), 2, config() + ":6: lidar.T_imu_lidar.R: is not a rotation");
  write_text(config(), "imu: {topic: /imu}\nlidar:\n  topic: /points\n");
  expect_refused(run(), 2, "lidar.T_imu_lidar.p is missing", 2);
  write_text(config(), small_config() + "  voxel_size: small\n  voxel_sise: 0.2\n");
  expect_refused(run(), 2, config() + ":9: lidar.voxel_sise: no such setting", 2);
  write_text(config(), "robot: {urdf: nowhere.urdf}\n");
  expect_refused(run(), 2, "nowhere.urdf: no such URDF file");
  fs::copy_file(recording(), config(), fs::copy_options::overwrite_existing);
  expect_refused(run(), 2, "robot.yaml");
  fs::remove(config());
  expect_refused(run(), 2, "robot.yaml: no such configuration file");
}

TEST_F(BadInput, AnOutputThatCannotBeWrittenIsNoticedBeforeTheInputIsRead) {
  // No recording is there: had it been looked for first, the exit code would be 3.
  write_text(folder / "file", "");
  Finished f = kilvo({"run", recording(), "--config", config(), "--out", folder / "file"});
  EXPECT_EQ(f.code, 2);
  EXPECT_THAT(f.err, HasSubstr("file"));
  f = kilvo({"run", recording(), "--config", config(), "--out", folder / "file/deeper"});
  EXPECT_EQ(f.code, 2);
  f = kilvo({"run", recording(), "--config", config(), "--out", "/proc/kilvo"});
  EXPECT_EQ(f.code, 2);
  record(small_walk(1).measurements);
  fs::create_directories(folder / "out/odometry.tum");
  f = run();
  EXPECT_EQ(f.code, 2);
  EXPECT_THAT(f.err, HasSubstr("odometry.tum"));
}

TEST_F(BadInput, AMapThatCannotBeWrittenIsNoticedBeforeTheInputIsRead) {
  const Finished f = run({"--map", "/proc/kilvo/map.ply"});
  EXPECT_EQ(f.code, 2);
  EXPECT_THAT(f.err, HasSubstr("/proc/kilvo"));
}

}  // namespace bad_input_test
}  // namespace kilvo::stories
