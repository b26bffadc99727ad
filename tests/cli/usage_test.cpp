// Words on the command line, and the verbs that do not run anything.
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace usage_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

void expect_error(const std::vector<std::string>& words, int code, const std::string& text) {
  const Finished f = kilvo(words);
  EXPECT_EQ(f.code, code) << f.err;
  EXPECT_THAT(f.err, HasSubstr(text));
  EXPECT_THAT(f.err, HasSubstr("kilvo: error: "));
  EXPECT_EQ(f.out, "");
}

TEST(Usage, MistypedWordsNameTheNearest) {
  expect_error({"rnu", "x.bag"}, 2, "no verb 'rnu', nearest is 'run'");
  expect_error({"config", "shwo"}, 2, "no verb 'shwo', nearest is 'show'");
  expect_error({"run", "x.bag", "--sensor", "imu"}, 2, "run: no option '--sensor', nearest is '--sensors'");
  expect_error({"--verison"}, 2, "no option '--verison', nearest is '--version'");
  expect_error({"run", "x.bag", "--out", "never_written", "--sensors", "imu,lydar"}, 2, "no sensor 'lydar', nearest is 'lidar'");
  expect_error({"run", "x.bag", "--out", "never_written", "--sensors", ""}, 2, "no sensor ''");
  expect_error({"run", "x.bag", "--out", "never_written", "--sensors", "imu,"}, 2, "no sensor ''");
  expect_error({"eval", "a", "b", "--align", "sim3"}, 2, "nearest is 'se3'");
}

TEST(Usage, MissingOrImpossibleWordsAreSaid) {
  expect_error({}, 2, "name a verb");
  expect_error({"run"}, 2, "INPUT");
  expect_error({"run", "x.bag"}, 2, "--out");
  expect_error({"config"}, 2, "subcommand");
  expect_error({"run", "x.bag", "--out", "never_written", "--threads", "0"}, 2, "--threads");
  expect_error({"run", "x.bag", "--out", "never_written", "--threads", "many"}, 2, "--threads");
  expect_error({"run", "x.bag", "--out", "never_written", "--start", "-1"}, 2, "--start");
  expect_error({"run", "x.bag", "--out", "never_written", "--start", "nan"}, 2, "--start");
  expect_error({"run", "x.bag", "--out", "never_written", "--duration", "0"}, 2, "--duration");
  expect_error({"run", "x.bag", "--out", "never_written", "--map", "m.ply", "--no-map"}, 2, "exclude each other");
  for (const char* drop : {"lidar", "lidar:", "lidar:5", "lidar:6-5", "lidar:a-b", "lidar:1-2x", ":1-2", "lidar:nan-2"}) {
    expect_error({"run", "x.bag", "--out", "never_written", "--drop", drop}, 2, "");
  }
  for (const char* degraded : {"dark", "dark:", "dark:5", "dark:6-5", "bright:1-2", ":1-2", "camera:1-2"}) {
    expect_error({"run", "x.bag", "--out", "never_written", "--degrade", degraded}, 2, "--degrade");
  }
  for (const char* delay : {"lidar", "lidar:", "lidar:-5", "lidar:a", "lidar:5ms", "sonar:5", "lidar:1e9"}) {
    expect_error({"run", "x.bag", "--out", "never_written", "--delay", delay}, 2, "");
  }
  for (const char* speed : {"0", "-1", "nan", "1e9"})
    expect_error({"run", "x.bag", "--out", "never_written", "--realtime", speed}, 2, "--realtime");
}

TEST(Usage, SensorsThatCannotBeUsedAreRefused) {
  const TemporaryFolder folder;
  expect_error({"run", "x.bag", "--out", folder / "out", "--sensors", "lidar"}, 2, "the imu is needed");
  write_text(folder / "robot.yaml", "imu: {topic: /imu}");
  expect_error({"run", "x.bag", "--out", folder / "out", "--config", folder / "robot.yaml", "--sensors", "imu,lidar"}, 2,
               "lidar.topic is missing");
  expect_error({"run", "x.bag", "--out", folder / "out", "--config", folder / "robot.yaml", "--sensors", "camera,imu"}, 2,
               "the camera needs the lidar");
}

TEST(Usage, HelpAndVersionGoToStdout) {
  const Finished version = kilvo({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.out, "kilvo 0.1.0\n");
  const Finished help = kilvo({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* verb : {"run", "live", "info", "eval", "compare", "eval-contacts", "report", "config", "demo"}) {
    EXPECT_THAT(help.out, HasSubstr(verb));
    const Finished its_help = kilvo({verb, "--help"});
    EXPECT_EQ(its_help.code, 0) << verb;
    EXPECT_THAT(its_help.out, AllOf(HasSubstr(verb), HasSubstr("--help")));
    EXPECT_EQ(its_help.err, "");
  }
  EXPECT_THAT(kilvo({"run", "--help"}).out, AllOf(HasSubstr("--no-deskew"), HasSubstr("--drop"), HasSubstr("KEY=VALUE")));
}

class Verbs : public Story {};

TEST_F(Verbs, EvalComparesTrajectories) {
  const SmallWalk walk = small_walk(3);
  lab::write_tum(folder / "gt.tum", walk.truth);
  const Finished text = kilvo({"eval", folder / "gt.tum", folder / "gt.tum"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("ATE           rmse 0.00 mm"));
  for (const char* align : {"se3", "yaw", "first"}) {
    const Finished f = kilvo({"eval", folder / "gt.tum", folder / "gt.tum", "--align", align, "--json"});
    const auto json = nlohmann::json::parse(f.out);
    EXPECT_EQ(json["align"], align);
    EXPECT_LT(json["ate_rmse_m"], 1e-8);
    EXPECT_LT(json["e2e_m"], 1e-8);
  }
}

TEST_F(Verbs, EvalRefusesFilesItCannotCompare) {
  const SmallWalk walk = small_walk(1);
  lab::write_tum(folder / "gt.tum", walk.truth);
  std::vector<lab::StampedPose> later = walk.truth;
  for (lab::StampedPose& pose : later) pose.t += std::chrono::seconds(100);
  lab::write_tum(folder / "later.tum", later);
  write_text(folder / "bad.tum", "# t x y z\n1 2 3\n");
  expect_error({"eval", folder / "missing.tum", folder / "gt.tum"}, 3, "missing.tum");
  expect_error({"eval", folder / "bad.tum", folder / "gt.tum"}, 3, "bad.tum:2");
  expect_error({"eval", folder / "later.tum", folder / "gt.tum"}, 3, "");
}

TEST_F(Verbs, EvalOfARunWithoutSweepsPointsToTheOdometry) {
  lab::write_tum(folder / "gt.tum", small_walk(1).truth);
  lab::write_tum(folder / "odometry.tum", small_walk(1).truth);
  lab::write_tum(folder / "sweeps.tum", {});
  expect_error({"eval", folder / "sweeps.tum", folder / "gt.tum"}, 3, "evaluate " + (folder / "odometry.tum") + " instead");
}

TEST_F(Verbs, CompareTellsRunsApart) {
  std::vector<lab::StampedPose> off = small_walk(3).truth;
  lab::write_tum(folder / "gt.tum", off);
  for (std::size_t i = 0; i < off.size(); ++i) off[i].T.p.z() += i % 2 == 0 ? 0.01 : -0.01;
  lab::write_tum(folder / "off.tum", off);
  const Finished f =
      kilvo({"compare", folder / "gt.tum", folder / "off.tum", "--gt", folder / "gt.tum", "--json", "--out", folder / "page.html"});
  ASSERT_EQ(f.code, 0) << f.err;
  const auto json = nlohmann::json::parse(f.out);
  EXPECT_EQ(json["align"], "se3");
  EXPECT_LT(json["runs"][0]["ate_rmse_m"], 1e-8);
  EXPECT_NEAR(json["runs"][1]["axis_rmse_m"][2], 0.01, 1e-4);
  EXPECT_THAT(read_text(folder / "page.html"), HasSubstr("off.tum"));
  expect_error({"compare", folder / "gt.tum", "--gt", folder / "missing.tum"}, 3, "missing.tum");
}

TEST_F(Verbs, InfoNamesWhatItFinds) {
  record(small_walk(1).measurements);
  const Finished f = kilvo({"info", recording(), "--config", config()});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.out, AllOf(HasSubstr("/imu "), HasSubstr("sensor_msgs/Imu"), HasSubstr("/points "), HasSubstr("sensor_msgs/PointCloud2"),
                           HasSubstr("timestamp (float64): nanoseconds, absolute"), HasSubstr("200.")));
  expect_error({"info", folder / "missing.bag"}, 3, "missing.bag");
}

TEST_F(Verbs, ConfigShowPrintsWhatConfigCheckFindsGood) {
  const Finished shown = kilvo({"config", "show", "--set", "lidar.voxel_size=0.125"});
  ASSERT_EQ(shown.code, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("voxel_size: 0.125"));
  write_text(folder / "shown.yaml", shown.out);
  const Finished checked = kilvo({"config", "check", folder / "shown.yaml"});
  EXPECT_EQ(checked.code, 0) << checked.err;
  EXPECT_THAT(checked.out, AllOf(HasSubstr("good"), HasSubstr("lidar (/livox/lidar)"), HasSubstr("camera")));
  const Finished again = kilvo({"config", "show", folder / "shown.yaml"});
  EXPECT_THAT(again.out, HasSubstr("voxel_size: 0.125"));
}

TEST_F(Verbs, ConfigCheckFindsMistakes) {
  EXPECT_EQ(kilvo({"config", "check", config()}).code, 0);
  write_text(config(), small_config() + "map: {resolution: 0}\n");
  expect_error({"config", "check", config()}, 2, config() + ":8: map.resolution: must be 0.001 to 100, not 0");
  write_text(config(), "lidar: {topic: /points}\n");
  expect_error({"config", "check", config()}, 2, "imu.topic is missing");
  expect_error({"config", "check", folder / "missing.yaml"}, 2, "missing.yaml");
}

TEST_F(Verbs, ConfigCheckLooksIntoTheUrdf) {
  const std::string robots = KILVO_SOURCE_DIR "/config/robots/", good = read_text(robots + "g1_12dof.urdf");
  const std::string urdf = folder / "robot.urdf";
  const auto expect = [&](const std::string& text, const std::string& error) {
    write_text(urdf, text);
    expect_error({"config", "check", robots + "g1.yaml", "--set", "robot.urdf=" + urdf}, 2, error);
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  expect("<robot>", urdf + " has no links: not a URDF file");
  expect(with("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>"), "axis has no length");
  expect(with("<origin xyz=\"0 0.064452 -0.1027\"", "<origin xyz=\"0 1e30 0\""), "origin is over 100 m away");
}

TEST_F(Verbs, EveryShippedRobotIsGood) {
  for (const char* robot : {"g1", "g1_29dof", "g1_cam_r", "g1_tilt", "g1_tilt_cam_r", "icub", "sim"}) {
    EXPECT_EQ(kilvo({"config", "check", KILVO_SOURCE_DIR "/config/robots/" + std::string(robot) + ".yaml"}).code, 0) << robot;
  }
}

TEST(Documents, TheListOfSettingsIsUpToDate) {
  EXPECT_TRUE(kilvo({"config", "show", "--markdown"}).out == read_text(KILVO_SOURCE_DIR "/docs/parameters.md"))
      << "run: kilvo config show --markdown > docs/parameters.md";
}

TEST_F(Verbs, TheProgramFindsItsConfigurationsWhereverItIsPut) {
  fs::create_directories(folder / "bin");
  fs::create_directories(folder / "share/kilvo");
  fs::copy(KILVO_PROGRAM, folder / "bin/kilvo");
  fs::copy(KILVO_SOURCE_DIR "/config", folder / "share/kilvo/config", fs::copy_options::recursive);
  const Finished f = run_program(folder / "bin/kilvo", {"config", "show"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.out, StartsWith("# " + (folder / "share/kilvo/config/robots/g1.yaml")));
  EXPECT_THAT(f.out, HasSubstr(folder / "share/kilvo/config/robots/g1_12dof.urdf"));
}

TEST_F(Verbs, TheDemoGoesFromNothingToAMap) {
  const Finished f = kilvo({"demo", "--out", folder / "demo", "--duration", "4", "--quiet"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.out, AllOf(HasSubstr("position error"), HasSubstr("As it should be."), HasSubstr("map.ply")));
  for (const char* file : {"recording.bag", "gt.tum", "config.yaml", "results/map.ply", "results/summary.json"}) {
    EXPECT_TRUE(fs::exists(folder / ("demo/" + std::string(file)))) << file;
  }
  expect_error({"demo", "--duration", "1"}, 2, "--duration");
}

}  // namespace usage_test
}  // namespace kilvo::stories
