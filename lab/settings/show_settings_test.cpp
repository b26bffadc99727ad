#include "lab/settings/show_settings.hpp"

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/settings/setting_list.hpp"

namespace kilvo::lab {
namespace show_settings_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

// All values by name. Rotations are compared apart: reading makes them orthonormal again, which may touch their last digit.
std::map<std::string, std::string> values_of(Settings s, Eigen::MatrixXd& rotations) {
  std::map<std::string, std::string> out;
  std::vector<double> numbers;
  for (const Setting& setting : list_settings(s)) {
    if (const auto* R = std::get_if<SO3*>(&setting.value)) {
      numbers.insert(numbers.end(), (*R)->matrix().data(), (*R)->matrix().data() + 9);
    } else {
      out[setting.key] = value_text(setting.value);
    }
  }
  rotations = Eigen::Map<Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
  return out;
}

std::vector<fs::path> shipped() {
  std::vector<fs::path> out;
  for (const char* folder : {"robots", "datasets"}) {
    for (const auto& entry : fs::directory_iterator(fs::path(KILVO_SOURCE_DIR) / "config" / folder)) {
      if (entry.path().extension() == ".yaml") out.push_back(entry.path());
    }
  }
  return out;
}

TEST(ShowSettings, ReadingWhatIsPrintedGivesTheSameSettings) {
  for (const fs::path& file : shipped()) {
    const Settings before = load_settings(file, std::vector<std::string>{"lidar.voxel_size=0.2", "imu.gyro_noise=1.2345678901234567e-4"});
    const Settings after = parse_settings(settings_yaml(before), "printed", "/nowhere");
    Eigen::MatrixXd R_before, R_after;
    EXPECT_EQ(values_of(before, R_before), values_of(after, R_after)) << file;
    EXPECT_LT((R_before - R_after).cwiseAbs().maxCoeff(), 1e-14) << file;
    EXPECT_EQ(before.robot.urdf, after.robot.urdf);
    EXPECT_EQ(before.given.size() <= after.given.size(), true);
  }
}

TEST(ShowSettings, StrangeTextSurvives) {
  const Settings before = parse_settings(R"(imu: {topic: "a \"b\" \\ c # d: {e}"})", "x", ".");
  EXPECT_EQ(parse_settings(settings_yaml(before), "printed", ".").topic(Sensor::imu), before.topic(Sensor::imu));
}

TEST(ShowSettings, WhatIsNotSetIsCommentedOut) {
  const std::string text = settings_yaml(parse_settings("imu: {topic: /imu}", "x", "."));
  EXPECT_THAT(text, HasSubstr("\n  # topic: (not set)"));
  EXPECT_THAT(text, HasSubstr("\n  topic: \"/imu\""));
  EXPECT_THAT(text, HasSubstr("# [m] position of the LiDAR in the IMU frame"));
}

TEST(ShowSettings, TheMarkdownHasEverySetting) {
  const std::string text = settings_markdown();
  Settings defaults;
  for (const Setting& setting : list_settings(defaults)) EXPECT_THAT(text, HasSubstr("| `" + setting.key + "` |"));
  EXPECT_THAT(text, HasSubstr("| `lidar.voxel_size` | `0.25` | m | number, 0.01 to 25 |"));
}

TEST(ShowSettings, TwentySettingsAreNotAdvanced) {
  Settings defaults;
  int common = 0;
  for (const Setting& setting : list_settings(defaults)) common += setting.has_default && !setting.advanced ? 1 : 0;
  EXPECT_EQ(common, 20);
  const std::string text = settings_markdown();
  EXPECT_LT(text.find("| `lidar.voxel_size`"), text.find("## Advanced"));
  EXPECT_GT(text.find("| `lidar.gate`"), text.find("## Advanced"));
}

TEST(ShowSettings, TheJsonIsNested) {
  const std::string text = settings_json(parse_settings("imu: {topic: /imu}\nestimator: {update: {max_iterations: 4}}", "x", "."));
  EXPECT_THAT(text, HasSubstr("\"update\": {\"max_iterations\": 4, "));
  EXPECT_THAT(text, testing::StartsWith("{\"imu\": {\"topic\": \"/imu\", "));
  EXPECT_THAT(text, HasSubstr("}}, \"calibration\": {\"online\": false}, \"live\": {"));
  EXPECT_THAT(text, testing::EndsWith("}}"));
}

class ShippedConfig : public testing::Test {
 protected:
  static Settings load(const std::string& name) { return load_settings(fs::path(KILVO_SOURCE_DIR) / "config" / name); }
};

TEST_F(ShippedConfig, TheFourG1MountsAreComplete) {
  const Sensor all[] = {Sensor::imu, Sensor::legs, Sensor::lidar, Sensor::camera};
  for (const char* name : {"g1", "g1_cam_r", "g1_tilt", "g1_tilt_cam_r"}) {
    const Settings s = load("robots/" + std::string(name) + ".yaml");
    EXPECT_NO_THROW(require_complete(s, all)) << name;
    EXPECT_THAT(s.robot.urdf, HasSubstr("left_ankle_roll_link"));
    // The camera looks forward and a little down, seen in the pelvis; the LiDAR is above it and behind.
    const SE3 T_pelvis_camera = s.robot.imu.T_link_imu * s.robot.camera.T_imu_camera;
    EXPECT_GT((T_pelvis_camera.R * Eigen::Vector3d::UnitZ()).x(), 0.97) << name;
    EXPECT_LT((T_pelvis_camera.R * Eigen::Vector3d::UnitZ()).z(), -0.1) << name;
    EXPECT_NEAR(T_pelvis_camera.p.z(), 0.445, 1e-6) << name;
    EXPECT_NEAR(T_pelvis_camera.p.x(), 0.092, 1e-6) << name;
  }
}

TEST_F(ShippedConfig, ThoseOfPublicRecordingsAreComplete) {
  const Sensor without_camera[] = {Sensor::imu, Sensor::legs, Sensor::lidar};
  for (const char* name : {"hr2_kilo", "liko"}) {
    EXPECT_NO_THROW(require_complete(load("datasets/" + std::string(name) + ".yaml"), without_camera)) << name;
  }
  const Sensor all[] = {Sensor::imu, Sensor::legs, Sensor::lidar, Sensor::camera};
  for (const char* name : {"kilvo_h", "kilvo_r"}) {
    const Settings s = load("datasets/" + std::string(name) + ".yaml");
    EXPECT_NO_THROW(require_complete(s, all)) << name;
    // The IMU hangs upside down (z down): the camera looks forward, its right is the IMU's left.
    EXPECT_GT((s.robot.camera.T_imu_camera.R * Eigen::Vector3d::UnitZ()).x(), 0.99) << name;
    EXPECT_GT((s.robot.camera.T_imu_camera.R * Eigen::Vector3d::UnitX()).y(), 0.99) << name;
  }
}

class UrdfInSettings : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("kilvo_settings_test_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    std::ofstream(folder_ / "robot.urdf")
        << "<robot name='r'><!-- <link name=\"ghost\"/> --><link name = 'base'/>\n<link name=\"foot_l\" />"
           "<link\nname=\"foot_r\"></link><joint type=\"fixed\" name=\"waist\"/></robot>";
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string error_of(const std::string& yaml) const {
    try {
      parse_settings(yaml, "robot.yaml", folder_);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "no error";
  }
  fs::path folder_;
};

TEST_F(UrdfInSettings, LinksAndJointsMustExist) {
  EXPECT_EQ(error_of("robot: {urdf: robot.urdf, locked_joints: [waist]}\nimu: {T_link_imu: {link: base}}"), "no error");
  EXPECT_THAT(error_of("robot:\n  urdf: robot.urdf\nimu:\n  T_link_imu:\n    link: bass\n"),
              testing::AllOf(HasSubstr("robot.yaml:5: imu.T_link_imu.link"), HasSubstr("no link 'bass', nearest is 'base'")));
  EXPECT_THAT(error_of("robot: {urdf: robot.urdf}\nimu: {T_link_imu: {link: ghost}}"), HasSubstr("no link 'ghost'"));
  EXPECT_THAT(error_of("robot: {urdf: robot.urdf, locked_joints: [waist, wrist]}"), HasSubstr("no joint 'wrist', nearest is 'waist'"));
  EXPECT_THAT(error_of("robot: {urdf: robot.urdf, feet: [{name: left, link: foot_l}, {name: right, link: foot_x}]}"),
              HasSubstr("no link 'foot_x'"));
  EXPECT_THAT(error_of("robot: {urdf: robot.urdf, feet: [{name: left, link: foot_l}, {name: right, link: foot_l}]}"),
              HasSubstr("both feet are on link foot_l"));
}

TEST_F(UrdfInSettings, AChainWithoutEndIsRefused) {
  std::ofstream file(folder_ / "long.urdf");
  file << "<robot name='r'>";
  for (int i = 0; i < 20000; ++i) file << "<link name='l" << i << "'/>";
  file << "</robot>";
  file.close();
  EXPECT_THAT(error_of("robot: {urdf: long.urdf}"), HasSubstr("long.urdf has 20000 links, at most 1000 are read"));
}

TEST_F(UrdfInSettings, AMissingFileIsNamedWithItsSetting) {
  EXPECT_THAT(error_of("robot:\n  urdf: other.urdf\n"),
              testing::AllOf(HasSubstr("robot.yaml:2: robot.urdf: "), HasSubstr("other.urdf: no such URDF file")));
  std::ofstream(folder_ / "empty.urdf") << "";
  EXPECT_EQ(error_of("robot: {urdf: empty.urdf}"), "no error");
  std::ofstream(folder_ / "text.urdf") << "nothing of the kind";
  EXPECT_THAT(error_of("robot: {urdf: text.urdf}"), HasSubstr("has no links"));
  std::ofstream(folder_ / "macro.urdf") << R"(<robot><link name="base"/><xacro:leg side="left"/></robot>)";
  EXPECT_THAT(error_of("robot: {urdf: macro.urdf}"), HasSubstr("macro.urdf is not expanded: xacro"));
}

TEST_F(UrdfInSettings, AFileThatIsNoConfigurationIsRefused) {
  EXPECT_THROW(load_settings(folder_ / "missing.yaml"), ConfigError);
  EXPECT_THROW(load_settings(folder_), ConfigError);
  std::ofstream(folder_ / "zeros.yaml") << std::string(100, '\0');
  EXPECT_THROW(load_settings(folder_ / "zeros.yaml"), ConfigError);
  fs::resize_file(folder_ / "zeros.yaml", 100 << 20);
  EXPECT_THROW(load_settings(folder_ / "zeros.yaml"), ConfigError);
}

}  // namespace show_settings_test
}  // namespace kilvo::lab
