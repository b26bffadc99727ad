// kilvo simulate: the files it writes, what others read in them, and KILVO on them.
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "lab/mapping/ply.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace simulate_test {

using testing::AllOf;
using testing::HasSubstr;

std::size_t lines_in(const std::string& path) {
  const std::string text = read_text(path);
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

/// A simulation in a folder of its own.
struct Simulated {
  TemporaryFolder folder;

  std::string file(const std::string& name) const { return folder / ("sim/" + name); }

  void expect_files() const {
    EXPECT_EQ(lines_in(file("gt.tum")), 5001U);
    EXPECT_EQ(lines_in(file("contacts.gt.csv")), 5002U);
    EXPECT_EQ(lines_in(file("imu_truth.csv")), 1002U);
    EXPECT_EQ(lines_in(file("exposure.csv")), 52U);
    EXPECT_THAT(read_text(file("exposure.csv")), HasSubstr("t,exposure_ms,gain,total,light\n1700000000.000000000,4.000000,0.23,0.92,1\n"));
    EXPECT_THAT(read_text(file("contacts.gt.csv")), AllOf(HasSubstr("t,left,right\n1700000000.000000000,1,1\n"), HasSubstr(",0,1\n")));
  }

  void expect_the_shipped_robot() const {
    const std::string robots = std::string(KILVO_SOURCE_DIR) + "/config/robots/";
    EXPECT_EQ(read_text(file("robot.urdf")), read_text(robots + "sim.urdf"));
    std::string config = read_text(file("config.yaml"));
    config.replace(config.find("robot.urdf"), 10, "sim.urdf");
    EXPECT_EQ(config, read_text(robots + "sim.yaml"));
    EXPECT_EQ(kilvo({"config", "check", file("config.yaml")}).code, 0);
  }

  void expect_that_ros_reads_it() const {
    const std::string script =
        "import rosbag, sys\n"
        "info = rosbag.Bag(sys.argv[1]).get_type_and_topic_info()[1]\n"
        "print(' '.join(f'{k}={v.msg_type}={v.message_count}' for k, v in sorted(info.items())))\n"
        "for topic, m, t in rosbag.Bag(sys.argv[1]).read_messages(topics=['/joint_states']):\n"
        "    assert len(m.name) == len(m.position) == 13, m\n"
        "    break\n";
    const Finished f = run_program("/usr/bin/python3", {"-c", script, file("recording.bag")});
    ASSERT_EQ(f.code, 0) << f.err;
    EXPECT_EQ(f.out,
              "/camera/image_raw=sensor_msgs/Image=51 /imu=sensor_msgs/Imu=1001 /joint_states=sensor_msgs/JointState=5001 "
              "/points=sensor_msgs/PointCloud2=50\n");
  }

  // The legs of another robot are refused by the first message, with the name of the joint that it lacks.
  void expect_that_another_robot_is_refused() const {
    const std::string robots = std::string(KILVO_SOURCE_DIR) + "/config/robots/";
    const Finished joints = kilvo({"run", folder / "sim", "--config", robots + "icub.yaml", "--out", folder / "icub"});
    EXPECT_EQ(joints.code, 2);
    EXPECT_THAT(joints.err, AllOf(HasSubstr("icub.yaml"), HasSubstr("joint "), HasSubstr("robot.locked_joints")));
    const std::string hr2 = std::string(KILVO_SOURCE_DIR) + "/config/datasets/hr2_kilo.yaml";
    const Finished feet = kilvo({"run", folder / "sim", "--config", hr2, "--set", "imu.topic=/imu", "--set", "legs.topic=/joint_states",
                                 "--sensors", "legs,imu", "--out", folder / "hr2"});
    EXPECT_EQ(feet.code, 2);
    EXPECT_THAT(feet.err, AllOf(HasSubstr("two feet"), HasSubstr("13")));
  }

  void expect_that_kilvo_runs_on_it() const {
    const std::string out = folder / "li";
    const Finished f = kilvo({"run", folder / "sim", "--sensors", "imu,lidar", "--out", out});
    ASSERT_EQ(f.code, 0) << f.err;
    EXPECT_THAT(f.err, HasSubstr("sim/config.yaml"));
    const auto errors = lab::evaluate(lab::read_tum(out + "/sweeps.tum"), lab::read_tum(file("gt.tum")), lab::Alignment::se3);
    EXPECT_LT(errors.ate_rmse_m, 0.01);
    EXPECT_GT(errors.path_length_m, 0.3);
  }
};

/// Of timing.csv: how many rows each stage has, and how long they took altogether, ms.
struct StageSums {
  std::map<std::string, std::size_t> rows;
  double total_ms = 0;
};
StageSums stage_sums(const std::string& path) {
  std::istringstream in(read_text(path));
  std::string t, stage, microseconds;
  std::getline(in, t);
  StageSums out;
  while (std::getline(in, t, ',') && std::getline(in, stage, ',') && std::getline(in, microseconds)) {
    ++out.rows[stage];
    if (stage != "contact") out.total_ms += 1e-3 * std::stod(microseconds);  // it is a part of `kinematic`
  }
  return out;
}

TEST(Simulate, AllThatIsRecordedIsUsedAndItsTimeCounted) {
  const Simulated walk;
  ASSERT_EQ(kilvo({"simulate", "room", "--out", walk.folder / "sim", "--seed", "4", "--duration", "3"}).code, 0);
  const Finished f = kilvo({"run", walk.folder / "sim", "--out", walk.folder / "all"});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("camera from /camera/image_raw"));
  EXPECT_THAT(f.err, testing::Not(HasSubstr("not supported")));
  const auto summary = nlohmann::json::parse(read_text(walk.folder / "all/summary.json"));
  const std::size_t sweeps = summary["sweeps"];
  StageSums stages = stage_sums(walk.folder / "all/timing.csv");
  EXPECT_EQ(lines_in(walk.folder / "all/sweeps.tum"), sweeps);  // none for an image
  for (const char* stage : {"lidar", "map", "other"}) EXPECT_EQ(stages.rows[stage], sweeps) << stage;
  EXPECT_EQ(stages.rows["visual"], summary["messages"]["camera"]["used"]);
  EXPECT_NEAR(summary["mean_ms_per_frame"], stages.total_ms / static_cast<double>(sweeps), 0.01);
  const lab::Cloud cloud = lab::read_cloud(walk.folder / "all/map.ply");
  ASSERT_EQ(cloud.rgb.size(), cloud.points_W.size());
  const auto grey = std::ranges::count_if(cloud.rgb, [](const auto& rgb) { return rgb[0] == rgb[1] && rgb[1] == rgb[2]; });
  EXPECT_LT(grey, 0.97 * static_cast<double>(cloud.rgb.size()));
  ASSERT_EQ(kilvo({"run", walk.folder / "sim", "--out", walk.folder / "again", "--threads", "1"}).code, 0);
  EXPECT_TRUE(read_text(walk.folder / "all/map.ply") == read_text(walk.folder / "again/map.ply"));
  const Finished info = kilvo({"info", walk.folder / "sim"});
  EXPECT_THAT(info.out, testing::Not(HasSubstr("not by this version")));
}

TEST(Simulate, TheSensorsThatAreRecordedAreAsTheyAreAmongAll) {
  const TemporaryFolder folder;
  for (const std::string& sensors : {std::string("legs,imu"), std::string("imu,legs,lidar,camera")}) {
    const std::string walk = folder / sensors;
    ASSERT_EQ(kilvo({"simulate", "room", "--out", walk, "--seed", "5", "--duration", "5", "--sensors", sensors, "--quiet"}).code, 0);
    ASSERT_EQ(kilvo({"run", walk, "--sensors", "legs,imu", "--out", walk + "/run", "--quiet", "--no-map"}).code, 0);
  }
  EXPECT_EQ(read_text(folder / "legs,imu/run/odometry.tum"), read_text(folder / "imu,legs,lidar,camera/run/odometry.tum"));
  EXPECT_LT(std::filesystem::file_size(folder / "legs,imu/recording.bag"), 5'000'000U);
  const Finished f = kilvo({"simulate", "room", "--out", folder / "x", "--sensors", "legs,imv"});
  EXPECT_EQ(f.code, 2);
  EXPECT_THAT(f.err, HasSubstr("no sensor 'imv', nearest is 'imu'"));
}

TEST(Simulate, AWalkGoesThroughTheLiveRunnerAsItWouldOnTheRobot) {
  const TemporaryFolder folder;
  ASSERT_EQ(kilvo({"simulate", "room", "--out", folder / "sim", "--seed", "5", "--duration", "5"}).code, 0);
  // Before INPUT, the speed left out; and slower than it was, so that a busy machine keeps up.
  for (const std::vector<std::string>& pace : {std::vector<std::string>{"--realtime"}, {"--realtime", "0.8", "--delay", "camera:60"}}) {
    std::vector<std::string> words = {"run"};
    words.insert(words.end(), pace.begin(), pace.end());
    for (const std::string& word : {folder / "sim", std::string("--out"), folder / "live"}) words.push_back(word);
    const Finished f = kilvo(words);
    ASSERT_EQ(f.code, 0) << f.err;
    const auto summary = nlohmann::json::parse(read_text(folder / "live/summary.json"));
    EXPECT_GT(summary["wall_seconds"], 4.5);
    EXPECT_EQ(summary["latency_ms"]["n"], summary["outputs"]);
    EXPECT_GT(summary["latency_ms"]["p50"], 0);
    EXPECT_LE(summary["latency_ms"]["p50"], summary["latency_ms"]["p99_9"]);
    EXPECT_GT(summary["correction_ms"]["n"], 20);
    for (const char* key : {"deadline_misses", "queue_drops", "queue_depth"}) EXPECT_TRUE(summary.contains(key)) << key;
    for (const char* thread : {"fast", "slow", "output"}) EXPECT_TRUE(summary["cpu_percent"].contains(thread)) << thread;
    EXPECT_EQ(lines_in(folder / "live/odometry.tum"), summary["outputs"]);
    EXPECT_EQ(lines_in(folder / "live/odometry_smooth.tum"), summary["outputs"]);
    EXPECT_EQ(lines_in(folder / "live/sweeps.tum"), summary["sweeps"]);
    EXPECT_GT(summary["sweeps"], 30);
    lab::read_tum(folder / "live/odometry.tum");  // throws on time going back
  }
}

TEST(Simulate, AWalkIsWrittenReadByOthersAndRunOn) {
  const Simulated walk;
  const Finished f = kilvo({"simulate", "room", "--out", walk.folder / "sim", "--seed", "3", "--duration", "5"});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.out, HasSubstr("5.0 s of 'room', seed 3"));
  walk.expect_files();
  walk.expect_the_shipped_robot();
  walk.expect_that_ros_reads_it();
  walk.expect_that_another_robot_is_refused();
  walk.expect_that_kilvo_runs_on_it();
}

TEST(Simulate, TheRecordingInTheFolderUsesTheConfigurationBesideIt) {
  const TemporaryFolder folder;
  ASSERT_EQ(kilvo({"simulate", "room", "--out", folder / "sim", "--duration", "1"}).code, 0);
  const Finished info = kilvo({"info", folder / "sim/recording.bag"});
  EXPECT_EQ(info.code, 0) << info.err;
  EXPECT_THAT(info.out,
              AllOf(HasSubstr("use: with " + (folder / "sim/config.yaml")), HasSubstr("joints: 13 of the 13 between torso_link")));
}

TEST(Simulate, TheSameSeedGivesTheSameBytes) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) ASSERT_EQ(kilvo({"simulate", "stairs", "--out", folder / name, "--duration", "0.3"}).code, 0);
  EXPECT_TRUE(read_text(folder / "a/recording.bag") == read_text(folder / "b/recording.bag"));
  EXPECT_TRUE(read_text(folder / "a/imu_truth.csv") == read_text(folder / "b/imu_truth.csv"));
}

TEST(Simulate, WhatCannotBeDoneIsSaid) {
  const TemporaryFolder folder;
  const auto expect_error = [&](const std::vector<std::string>& words, const std::string& text) {
    const Finished f = kilvo(words);
    EXPECT_EQ(f.code, 2) << f.err;
    EXPECT_THAT(f.err, HasSubstr(text));
  };
  expect_error({"simulate", "romm", "--out", folder / "x"}, "no scenario 'romm', nearest is 'room'");
  expect_error({"simulate", "room", "--out", folder / "x", "--duration", "-1"}, "--duration must be above 0");
  expect_error({"simulate", "room", "--out", folder / "x", "--duration", "nan"}, "--duration must be above 0");
  expect_error({"simulate", "room", "--out", folder / "x", "--seed", "-1"}, "--seed");
  expect_error({"simulate", "room"}, "--out");
  EXPECT_FALSE(std::filesystem::exists(folder / "x"));
  expect_error({"simulate", "room", "--out", "/proc/nowhere", "--duration", "1"}, "/proc/nowhere: cannot be created");
  write_text(folder / "file", "");
  expect_error({"simulate", "room", "--out", folder / "file", "--duration", "1"}, "file");
}

// A plan that the legs cannot follow is refused before anything is written; one that they can is another walk.
TEST(Simulate, AStepThatCannotBeReachedIsSaid) {
  const TemporaryFolder folder;
  const Finished f = kilvo({"simulate", "room", "--stride", "3", "--out", folder / "x", "--duration", "1"});
  EXPECT_EQ(f.code, 2);
  EXPECT_THAT(f.err, AllOf(HasSubstr("room: the walk cannot be done: at "), HasSubstr("from its hip, the leg reaches 0.600 m")));
  EXPECT_FALSE(std::filesystem::exists(folder / "x"));
  for (const char* stride : {"0", "-1", "nan", "1000"}) {
    const Finished refused = kilvo({"simulate", "room", "--stride", stride, "--out", folder / "x"});
    EXPECT_EQ(refused.code, 2) << stride;
    EXPECT_THAT(refused.err, HasSubstr("--stride must be above 0"));
  }
  EXPECT_EQ(kilvo({"simulate", "room", "--stride", "0.5", "--out", folder / "x", "--duration", "0.2"}).code, 0);
}

// What its user knows is the shipped robot; the truth is written beside it, in a form that can be run with.
TEST(Simulate, ARoughRobotIsDescribedAsTheNominalOne) {
  const Simulated walk;
  std::vector<std::string> words = {"simulate", "room", "--rough", "2", "--rough-only", "imu,mount,time", "--duration", "0.3", "--out"};
  words.push_back(walk.folder / "sim");
  ASSERT_EQ(kilvo(words).code, 0);
  walk.expect_the_shipped_robot();
  EXPECT_EQ(kilvo({"config", "check", walk.file("truth.yaml")}).code, 0);
  EXPECT_THAT(read_text(walk.file("truth.yaml")), AllOf(HasSubstr("urdf: truth.urdf"), HasSubstr("time_offset: -0.012\n")));
  EXPECT_EQ(read_text(walk.file("truth.urdf")), read_text(walk.file("robot.urdf")));
  EXPECT_THAT(read_text(walk.file("rough.yaml")), AllOf(HasSubstr("level: 2\nparts: [imu,mount,time]\n"), HasSubstr("g_sensitivity: [")));
  words.back() = walk.folder / "again";
  ASSERT_EQ(kilvo(words).code, 0);
  for (const char* name : {"recording.bag", "truth.yaml", "rough.yaml", "gt.tum"})
    EXPECT_TRUE(read_text(walk.file(name)) == read_text(walk.folder / ("again/" + std::string(name)))) << name;
}

TEST(Simulate, AnUnknownPartOfRoughnessIsSaid) {
  const TemporaryFolder folder;
  const Finished unknown = kilvo({"simulate", "room", "--rough", "1", "--rough-only", "imu,people", "--out", folder / "x"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("--rough-only: no part 'people'; there are lidar,scene,imu,legs,camera,mount,time"));
  const Finished alone = kilvo({"simulate", "room", "--rough-only", "imu", "--out", folder / "x"});
  EXPECT_EQ(alone.code, 2);
  EXPECT_THAT(alone.err, HasSubstr("--rough-only needs --rough 1 or 2"));
  EXPECT_FALSE(std::filesystem::exists(folder / "x"));
}

TEST(Simulate, WearThatIsNoNumberIsRefused) {
  const TemporaryFolder folder;
  for (const char* option : {"--leg-rate", "--imu-rate", "--lost", "--shock"}) {
    const Finished f = kilvo({"simulate", "stand", option, "nan", "--out", folder / "x", "--duration", "0.2"});
    EXPECT_EQ(f.code, 2) << option;
    EXPECT_THAT(f.err, HasSubstr(std::string(option) + ": nan is not a number"));
  }
}

TEST(Simulate, SweepsAndImagesAreOfTheSizeThatIsAskedFor) {
  const TemporaryFolder folder;
  ASSERT_EQ(kilvo({"simulate", "room", "--out", folder / "sim", "--duration", "2", "--sensors", "imu,lidar,camera", "--lidar-points",
                   "3000", "--lidar-rate", "20", "--image-width", "320", "--quiet"})
                .code,
            0);
  const Finished info = kilvo({"info", folder / "sim"});
  EXPECT_THAT(info.out, AllOf(HasSubstr("sensor_msgs/PointCloud2         40     20.00"), HasSubstr("320x240 colour")));
  const std::string config = read_text(folder / "sim/config.yaml");
  EXPECT_THAT(config, AllOf(HasSubstr("width: 320"), HasSubstr("height: 240"), HasSubstr("fx: 170.65"), HasSubstr("rate: 20")));
  // 3000 points of 26 bytes, of which those beyond the range are missing.
  EXPECT_LT(std::filesystem::file_size(folder / "sim/recording.bag"), 40U * 3000 * 32 + 20U * 320 * 240 * 3 + 400'000);
}

TEST(Simulate, HelpListsTheScenarios) {
  const Finished f = kilvo({"simulate", "--help"});
  EXPECT_EQ(f.code, 0);
  for (const char* name : {"room ", "stand ", "in_place ", "run ", "stairs ", "slip ", "soft ", "corridor ", "yard ", "blank_wall "})
    EXPECT_THAT(f.out, HasSubstr(name));
}

}  // namespace simulate_test
}  // namespace kilvo::stories
