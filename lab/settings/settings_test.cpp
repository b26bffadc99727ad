#include "lab/settings/settings.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <set>

#include "lab/settings/setting_list.hpp"
#include "lab/settings/show_settings.hpp"

namespace kilvo::lab {
namespace settings_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* identity = "[1, 0, 0, 0, 1, 0, 0, 0, 1]";

Settings parse(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
  return parse_settings(yaml, "robot.yaml", ".", overrides);
}

std::string error_of(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
  try {
    parse(yaml, overrides);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Settings, AreReadFromTheirSections) {
  const Settings s = parse(
      "imu:\n  topic: /imu\n  gyro_noise: 1e-3\n"
      "lidar:\n  topic: /points\n  T_imu_lidar: {p: [1, 2, 3], R: [0, -1, 0, 1, 0, 0, 0, 0, 1]}\n  voxel_size: 0.2\n  max_range: +40\n"
      "map: {voxel_size: 2, resolution: 0.1, max_nodes: 5000}\n"
      "estimator:\n  gravity_align: false\n  max_wait: 0.5\n  initial: {still_time: 1}\n  update: {max_iterations: 3}\n");
  EXPECT_EQ(s.topic(Sensor::imu), "/imu");
  EXPECT_EQ(s.topic(Sensor::lidar), "/points");
  EXPECT_FALSE(s.has(Sensor::camera));
  EXPECT_EQ(s.estimator.noise.gyro, 1e-3);
  EXPECT_EQ(s.robot.lidar.T_imu_lidar.p, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE((s.robot.lidar.T_imu_lidar.R * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_EQ(s.robot.lidar.max_range, 40);
  EXPECT_EQ(s.estimator.lidar.voxel_size, 0.2);
  EXPECT_EQ(s.estimator.map.voxel_size, 2);
  EXPECT_EQ(s.estimator.map.max_nodes, 5000);
  EXPECT_EQ(s.mapping.resolution, 0.1);
  EXPECT_FALSE(s.estimator.gravity_align);
  EXPECT_EQ(s.estimator.max_wait, 0.5);
  EXPECT_EQ(s.estimator.initial.still_time, 1);
  EXPECT_EQ(s.estimator.update.max_iterations, 3);
}

TEST(Settings, AnOverrideWinsOverTheFile) {
  const Settings s = parse("lidar: {voxel_size: 0.1}", {"lidar.voxel_size=0.2", "estimator.gravity_align=false",
                                                        "lidar.T_imu_lidar.p=[1, 2, 3]", "map={resolution: 0.1, voxel_size: 2}"});
  EXPECT_EQ(s.estimator.lidar.voxel_size, 0.2);
  EXPECT_FALSE(s.estimator.gravity_align);
  EXPECT_EQ(s.robot.lidar.T_imu_lidar.p, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(s.estimator.map.voxel_size, 2);
}

TEST(Settings, AWrongOverrideIsNamed) {
  EXPECT_EQ(error_of("imu:", {"lidar.voxel_sise=0.2"}),
            "--set lidar.voxel_sise=0.2: lidar.voxel_sise: no such setting, nearest is lidar.voxel_size");
  EXPECT_THAT(error_of("imu:", {"lidar.voxel_size"}), StartsWith("--set lidar.voxel_size: must be KEY=VALUE"));
  EXPECT_THAT(error_of("imu:", {"lidar.voxel_size="}), HasSubstr("must be a number, not nothing"));
  EXPECT_THAT(error_of("imu:", {"lidar.voxel_size=-1"}),
              HasSubstr("--set lidar.voxel_size=-1: lidar.voxel_size: must be 0.01 to 25, not -1"));
  EXPECT_THAT(error_of("imu:", {"lidar=3"}), HasSubstr("must be a map of settings"));
}

TEST(Settings, AnUnknownKeyNamesFileLineKeyAndTheNearest) {
  EXPECT_EQ(error_of("imu:\n  topic: /imu\nlidar:\n  rate: 10\n  voxel_sise: 0.2\n"),
            "robot.yaml:5: lidar.voxel_sise: no such setting, nearest is lidar.voxel_size");
  EXPECT_EQ(error_of("imu:\n  topik: /imu\n"), "robot.yaml:2: imu.topik: no such setting, nearest is imu.topic");
  EXPECT_EQ(error_of("lidr: {}\n"), "robot.yaml:1: lidr: no such setting, nearest is lidar");
  EXPECT_EQ(error_of("estimator: {inital: {}}\n"), "robot.yaml:1: estimator.inital: no such setting, nearest is estimator.initial");
}

TEST(Settings, ARightKeyInTheWrongSectionIsFound) {
  EXPECT_THAT(error_of("lidar:\n  max_nodes: 9\n"), HasSubstr("robot.yaml:2: lidar.max_nodes: no such setting, nearest is map.max_nodes"));
}

TEST(Settings, AWrongTypeNamesFileLineKeyAndWhatIsWanted) {
  EXPECT_EQ(error_of("lidar:\n  voxel_size: big\n"), "robot.yaml:2: lidar.voxel_size: must be a number, not 'big'");
  EXPECT_EQ(error_of("lidar:\n  voxel_size: \"0.2\"\n"), "robot.yaml:2: lidar.voxel_size: must be a number, not '0.2'");
  EXPECT_EQ(error_of("lidar:\n  voxel_size: [1, 2]\n"), "robot.yaml:2: lidar.voxel_size: must be a number, not a list of 2");
  EXPECT_THAT(error_of("lidar: {voxel_size: .nan}"), HasSubstr("must be a number"));
  EXPECT_THAT(error_of("lidar: {voxel_size: nan}"), HasSubstr("must be a finite number"));
  EXPECT_THAT(error_of("lidar: {max_range: inf}"), HasSubstr("must be a finite number"));
  EXPECT_THAT(error_of("lidar: {max_range: 1e999}"), HasSubstr("must be a number"));
  EXPECT_THAT(error_of("lidar: {max_range: 40 m}"), HasSubstr("must be a number, not '40 m'"));
  EXPECT_THAT(error_of("map: {max_nodes: 1000.5}"), HasSubstr("must be a whole number"));
  EXPECT_THAT(error_of("map: {max_nodes: 1e12}"), HasSubstr("must be a whole number"));
  EXPECT_THAT(error_of("estimator: {gravity_align: yes}"), HasSubstr("must be true or false, not 'yes'"));
  EXPECT_THAT(error_of("imu: {topic: [a]}"), HasSubstr("must be a text, not a list of 1"));
  EXPECT_THAT(error_of("imu: {topic: }"), HasSubstr("must be a text, not nothing"));
  EXPECT_THAT(error_of("imu: 3"), HasSubstr("robot.yaml:1: imu: must be a map of settings"));
  EXPECT_THAT(error_of("lidar: {T_imu_lidar: {p: [1, 2]}}"),
              HasSubstr("lidar.T_imu_lidar.p: must be a list of 3 numbers, not a list of 2"));
  EXPECT_THAT(error_of("camera: {distortion: 0.1}"), HasSubstr("must be a list of numbers"));
}

TEST(Settings, ARotationMustBeOne) {
  const auto with = [](const std::string& R) { return error_of("lidar:\n  T_imu_lidar:\n    R: " + R + "\n"); };
  EXPECT_EQ(with(identity), "no error");
  EXPECT_THAT(with("[1, 0, 0, 0, 1, 0, 0, 0, 1.0004]"), "no error");
  EXPECT_THAT(with("[1, 0, 0, 0, 1, 0, 0, 0, 1.001]"),
              AllOf(StartsWith("robot.yaml:3: lidar.T_imu_lidar.R: is not a rotation"), HasSubstr("0.002")));
  EXPECT_THAT(with("[1, 0, 0, 0, 1, 0, 0, 0, -1]"), HasSubstr("is not a rotation but a reflection"));
  EXPECT_THAT(with("[0, 0, 0, 0, 0, 0, 0, 0, 0]"), HasSubstr("is not a rotation"));
  EXPECT_THAT(with("[1, 0, 0, 0, 1, 0, 0, 0]"), HasSubstr("must be a list of 9 numbers"));
  EXPECT_THAT(with("[1, 0, 0, 0, 1, 0, 0, 0, nan]"), HasSubstr("must be a finite number"));
}

TEST(Settings, ReadsQuaternionsAndRollPitchYawAsTheMatrixThatTheyAre) {
  const auto R = [](const std::string& form) {
    return parse_settings("lidar: {T_imu_lidar: {p: [0, 0, 0], " + form + "}}", "robot.yaml", "/").robot.lidar.T_imu_lidar.R.matrix();
  };
  const Eigen::Matrix3d quarter_about_z = (Eigen::Matrix3d() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished();
  EXPECT_LT((R("q: [0, 0, 0.70710678, 0.70710678]") - quarter_about_z).norm(), 1e-7);
  EXPECT_LT((R("rpy: [0, 0, 1.5707963268]") - quarter_about_z).norm(), 1e-9);
  EXPECT_LT((R("R: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]") - quarter_about_z).norm(), 1e-12);
  // Roll first, then pitch, both about fixed axes: z goes to -y, and stays there.
  EXPECT_LT((R("rpy: [1.5707963268, 1.5707963268, 0]").col(2) - Eigen::Vector3d(0, -1, 0)).norm(), 1e-9);
}

TEST(Settings, ARotationOfAnotherFormIsRefusedWithTheReason) {
  const auto with = [](const std::string& form) { return error_of("lidar:\n  T_imu_lidar:\n    " + form + "\n"); };
  EXPECT_EQ(with("rpy: [0, 0, 90]"),
            "robot.yaml:3: lidar.T_imu_lidar.rpy: must be in radians: 90 is more than a turn; 90 degrees are 1.57079633 radians");
  EXPECT_THAT(with("q: [1, 0, 0]"), HasSubstr("must be a quaternion of 4 numbers (x, y, z, w)"));
  EXPECT_THAT(with("q: [1, 1, 0, 0]"), HasSubstr("the quaternion's norm is 1.414, not 1"));
  EXPECT_THAT(with("q: [0, 0, 0, 1]\n    rpy: [0, 0, 0]"), HasSubstr("the rotation is given twice: one of R, q, rpy"));
}

TEST(Settings, APoseOfTheOppositeDirectionIsAnsweredWithItsInverse) {
  EXPECT_EQ(
      error_of("lidar:\n  T_lidar_imu: {p: [1, 2, 3], rpy: [0, 0, 1.57079632679489662]}\n"),
      "robot.yaml:2: lidar.T_lidar_imu: must be lidar.T_imu_lidar, which takes a point of the second frame into the first; the inverse of "
      "the pose given is T_imu_lidar: {p: [-2, 1, -3], R: [0, 1, 0, -1, 0, 0, 0, 0, 1]}");
}

TEST(Settings, OtherFormsOfAPoseAreAnsweredWithThoseThatThereAre) {
  const std::string forms =
      "a pose is {p: [x, y, z]} in metres with one of R: [9 numbers, row by row], q: [x, y, z, w], rpy: [roll, pitch, yaw] in radians";
  for (const std::string name : {"quaternion", "euler", "rotation", "translation", "rpy_deg"}) {
    EXPECT_EQ(error_of("lidar: {T_imu_lidar: {" + name + ": [0, 0, 0]}}"),
              "robot.yaml:1: lidar.T_imu_lidar." + name + ": no such setting: " + forms);
  }
  const std::string conversion = "; the matrix given is {p: [1, 2, 3], R: [0, -1, 0, 1, 0, 0, 0, 0, 1]}";
  EXPECT_EQ(error_of("lidar: {T_imu_lidar: [0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1]}"),
            "robot.yaml:1: lidar.T_imu_lidar: " + forms + conversion);
  EXPECT_EQ(error_of("lidar: {T_imu_lidar: [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]]}"),
            "robot.yaml:1: lidar.T_imu_lidar: " + forms + conversion);
  EXPECT_EQ(error_of("lidar: {T_imu_lidar: [1, x]}"), "robot.yaml:1: lidar.T_imu_lidar: " + forms);
}

TEST(Settings, NumbersThatNoRobotHasAreRefused) {
  EXPECT_THAT(error_of("imu: {gyro_noise: 1e300}"), HasSubstr("imu.gyro_noise: must be above 0, at most 1000, not 1e+300"));
  EXPECT_THAT(error_of("lidar: {T_imu_lidar: {p: [1e30, 0, 0]}}"),
              HasSubstr("lidar.T_imu_lidar.p: must be metres on a robot, at most 10000 each, not [1e+30, 0, 0]"));
  EXPECT_THAT(error_of("camera: {distortion: [0, 1e300, 0, 0]}"), HasSubstr("camera.distortion: must be numbers of a lens, not 1e+300"));
  EXPECT_EQ(error_of("lidar: {T_imu_lidar: {p: [-11, -23.29, 44.12]}}"), "no error") << "millimetres are for `kilvo doctor` to name";
}

TEST(Settings, AllMistakesAreToldAtOnce) {
  EXPECT_EQ(error_of("lidar:\n  voxel_size: big\n  rate: 0\ncamera:\n  topik: /c\n", {"map.radius=-1"}),
            "robot.yaml:2: lidar.voxel_size: must be a number, not 'big'\n"
            "robot.yaml:5: camera.topik: no such setting, nearest is camera.topic\n"
            "robot.yaml:3: lidar.rate: must be above 0, at most 1000, not 0\n"
            "--set map.radius=-1: map.radius: must be above 0, at most 10000, not -1");
}

TEST(Settings, ANearlyRotationIsMadeOne) {
  const Settings s = parse("lidar: {T_imu_lidar: {R: [0.9992, 0, -0.0401, 0, -1, 0, -0.0401, 0, -0.9992]}}");
  const Eigen::Matrix3d R = s.robot.lidar.T_imu_lidar.R.matrix();
  EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_NEAR(R(0, 0), 0.9992, 1e-4);
}

TEST(Settings, RangesAreCheckedAlsoTogether) {
  EXPECT_THAT(error_of("imu: {rate: 0}"), HasSubstr("imu.rate: must be above 0, at most 100000, not 0"));
  EXPECT_THAT(error_of("lidar:\n  voxel_size: 0.5\n"),
              HasSubstr("robot.yaml:2: lidar.voxel_size: lidar.voxel_size (0.5) must be at most a quarter of map.voxel_size (1)"));
  EXPECT_EQ(error_of("lidar: {voxel_size: 0.5}\nmap: {voxel_size: 2}"), "no error");
  EXPECT_THAT(error_of("lidar:\n  min_range: 5\n  max_range: 4\n"), HasSubstr("must be below lidar.max_range"));
  EXPECT_THAT(error_of("legs: {type: joint}"), HasSubstr("must be one of joints, feet, not 'joint', nearest is joints"));
  EXPECT_THAT(error_of("camera: {distortion: [1, 2, 3]}"), HasSubstr("must have 4 or 5 numbers"));
  EXPECT_THAT(error_of("lidar: {own_body: [0, 0, 0, 1, 1]}"), HasSubstr("must have 6 numbers for each box, not 5"));
  EXPECT_THAT(error_of("lidar: {own_body: [0, 0, 0, 1, 1, 1, 0, 2, 0, 1, 1, 1]}"),
              HasSubstr("box 2: the least corner (2) must be below the greatest (1) along y"));
  EXPECT_NO_THROW(parse("lidar: {own_body: [0, 0, 0, 1, 1, 1]}"));
  for (const char* name : {"/kilvo", "kilvo/", "my robot", "a//b", "2nd"}) {
    EXPECT_THAT(error_of(std::string("live: {name: '") + name + "'}"), HasSubstr("live.name: must be a name of ROS")) << name;
  }
  EXPECT_NO_THROW(parse("live: {name: robot_1/kilvo}"));
  EXPECT_THAT(error_of("camera: {model: equidistant, distortion: [1, 2, 3, 4, 5]}"), HasSubstr("must have 4 numbers"));
}

TEST(Settings, ReadingsOfJointsAreReadAndShown) {
  const std::string text = R"({"hip": {"zero": 0.25}, "knee": {"from": "left_knee", "sign": -1}})";
  Settings s = parse("robot: {joints: " + text + "}");
  EXPECT_EQ(s.robot.joints.at("knee"), (JointReading{"left_knee", -1, 0}));
  EXPECT_EQ(s.robot.joints.at("hip"), (JointReading{"", 1, 0.25}));
  EXPECT_EQ(value_text(&s.robot.joints), text);
  EXPECT_TRUE(parse("robot: {joints: {}}").robot.joints.empty());
  EXPECT_THAT(error_of("robot: {joints: [knee]}"),
              HasSubstr("robot.joints: must be a map of joints, JOINT: {from, sign, zero}, not a list"));
  EXPECT_THAT(error_of("robot: {joints: {knee: -1}}"), HasSubstr("must be {from, sign, zero}, not '-1'"));
  EXPECT_THAT(error_of("robot: {joints: {knee: {scale: -1}}}"), HasSubstr("'scale': a joint has no such entry, nearest is"));
  EXPECT_THAT(error_of("robot: {joints: {knee: {sign: 0.5}}}"), HasSubstr("must be 1, or -1 where it turns the other way, not '0.5'"));
  EXPECT_THAT(error_of("robot: {joints: {knee: {zero: .inf}}}"), HasSubstr("robot.joints: must be a"));
  EXPECT_THAT(error_of("robot: {joints: {knee: {zero: 1}, knee: {}}}"), HasSubstr("'knee' is given twice"));
}

TEST(Settings, TwoFeetAreRead) {
  const std::string left = "{name: left, link: l, sole: [[0, 0, 1], [1, 0, 1]]}", right = "{name: right, link: r}";
  const Settings s = parse("robot: {feet: [" + right + ", " + left + "]}");
  EXPECT_EQ(s.robot.feet[0].link, "l");
  EXPECT_EQ(s.robot.feet[0].sole.size(), 2);
  EXPECT_EQ(s.robot.feet[1].link, "r");
  EXPECT_THAT(error_of("robot: {feet: [" + left + "]}"), HasSubstr("must be a list of 2 feet"));
  EXPECT_THAT(error_of("robot: {feet: [" + left + ", " + left + "]}"), HasSubstr("there are two left feet"));
  EXPECT_THAT(error_of("robot: {feet: [{name: left}, " + right + "]}"), HasSubstr("the left foot has no link"));
  EXPECT_THAT(error_of("robot:\n  feet:\n    - {name: left, lnk: l}\n    - " + right),
              HasSubstr("robot.yaml:3: robot.feet: 'lnk': a foot has no such entry, nearest is 'link'"));
  EXPECT_THAT(error_of("robot: {feet: [3, 4]}"), HasSubstr("must be a foot"));
}

TEST(Settings, BrokenYamlIsACleanError) {
  EXPECT_THAT(error_of("imu: {topic: a}\nimu: {topic: b}\n"), HasSubstr("robot.yaml:2: imu: given twice"));
  EXPECT_THAT(error_of("imu:\n  topic: a\n  topic: b\n"), HasSubstr("robot.yaml:3: imu.topic: given twice"));
  for (const char* text : {"", "\n", "# nothing\n", "3", "[a, b]", "just words"})
    EXPECT_THAT(error_of(text), HasSubstr("no settings in it")) << text;
  EXPECT_THAT(error_of("imu: {topic: \n\n"), HasSubstr("not valid YAML"));
  EXPECT_THAT(error_of("imu: [1\n"), StartsWith("robot.yaml:"));
  EXPECT_THAT(error_of("\tx: 1"), HasSubstr("not valid YAML"));
  EXPECT_THAT(error_of("a: 1\n---\nb: 1\n"), HasSubstr("more than one YAML document"));
  EXPECT_THAT(error_of("? [a, b]\n: 3\n"), HasSubstr("no such setting"));
  EXPECT_THAT(error_of("imu: &x\n  <<: *x\n"), testing::Not("no error"));
  EXPECT_THAT(error_of(std::string(100000, '[')), HasSubstr("not valid YAML"));
  EXPECT_THAT(error_of("#REC\x01\xff\xfe\x02: \x03"), testing::Not("no error"));
}

TEST(Settings, AnySingleDamagedByteIsAnErrorOrGoodSettings) {
  std::ifstream in(KILVO_SOURCE_DIR "/config/robots/g1.yaml");
  const std::string good{std::istreambuf_iterator<char>(in), {}};
  ASSERT_GT(good.size(), 500);
  for (std::size_t i = 0; i < good.size(); i += 3) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ (1 << (i % 8)));
    EXPECT_NO_THROW(error_of(bad)) << i;  // nothing but ConfigError
  }
}

TEST(Settings, ACompleteSensorIsAskedForOnlyWhenUsed) {
  const Settings s = parse("imu:\n  topic: /imu\nlidar:\n  topic: /points\n");
  const Sensor imu[] = {Sensor::imu}, both[] = {Sensor::imu, Sensor::lidar};
  EXPECT_NO_THROW(require_complete(s, imu));
  try {
    require_complete(s, both);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "robot.yaml: lidar.T_imu_lidar.p is missing: the sensor 'lidar' cannot be used without it\n"
                 "robot.yaml: lidar.T_imu_lidar.R is missing: the sensor 'lidar' cannot be used without it");
  }
}

TEST(Settings, EveryNumberHasARangeAndItsDefaultIsInIt) {
  Settings defaults;
  for (const Setting& setting : list_settings(defaults)) {
    std::optional<double> value;
    if (const auto* x = std::get_if<double*>(&setting.value)) value = **x;
    if (const auto* x = std::get_if<int*>(&setting.value)) value = **x;
    if (!value) continue;
    const auto range = range_of(setting.key);
    ASSERT_TRUE(range) << setting.key << " is missing in lab/settings/ranges.cpp";
    EXPECT_TRUE(range->contains(*value) || !setting.has_default) << setting.key << " = " << *value << ", must be " << range->text();
  }
}

TEST(Settings, EveryKeyIsThereOnceAndHasAMeaning) {
  Settings defaults;
  std::set<std::string> seen;
  for (const Setting& setting : list_settings(defaults)) {
    EXPECT_TRUE(seen.insert(setting.key).second) << setting.key;
    EXPECT_GT(setting.meaning.size(), 5) << setting.key;
    EXPECT_FALSE(setting.unit.empty()) << setting.key;
  }
  // Every field of the process noise found its section.
  for (const char* key :
       {"imu.gyro_noise", "imu.accel_noise", "imu.gyro_bias_walk", "imu.accel_bias_walk", "legs.foot_noise", "camera.exposure_walk"}) {
    EXPECT_TRUE(seen.contains(key)) << key;
  }
}

}  // namespace settings_test
}  // namespace kilvo::lab
