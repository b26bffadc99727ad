#include "lab/settings/edit_settings.hpp"

#include <gtest/gtest.h>

#include "lab/settings/settings.hpp"

namespace kilvo::lab {
namespace edit_settings_test {

const std::string text =
    "# a robot\nimu:\n  topic: /imu  # as recorded\n  T_link_imu: {link: pelvis, p: [0, 0, 1], R: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\nlidar:\n  "
    "rate: 10\n";

TEST(EditSettings, AValueChangesAndNothingElse) {
  EXPECT_EQ(with_setting(text, "imu.T_link_imu.p", "[0, 0, 2]"),
            "# a robot\nimu:\n  topic: /imu  # as recorded\n  T_link_imu: {link: pelvis, p: [0, 0, 2], R: [1, 0, 0, 0, 1, 0, 0, 0, "
            "1]}\nlidar:\n  rate: 10\n");
  EXPECT_EQ(with_setting(text, "imu.topic", "/other").substr(15, 40), "  topic: /other  # as recorded\n  T_link_");
  EXPECT_EQ(with_setting(text, "imu.T_link_imu.link", "torso").substr(44, 33), "  T_link_imu: {link: torso, p: [0");
  EXPECT_EQ(with_setting(text, "lidar.rate", "20").substr(text.size() - 18), "lidar:\n  rate: 20\n");
}

TEST(EditSettings, AListOrAMapOverSeveralLinesIsReplacedAsAWhole) {
  const std::string feet = "robot:\n  feet:\n    - {name: left, link: l}  # one\n    - name: right\n      link: r\n  urdf: a.urdf\n";
  EXPECT_EQ(with_setting(feet, "robot.feet", "[]"), "robot:\n  feet:\n    []\n  urdf: a.urdf\n");
  const std::string joints = "robot:\n  joints:\n    knee: {sign: -1}\n    hip:\n      zero: 0.1\n\n# end\nimu: {rate: 1}\n";
  EXPECT_EQ(with_setting(joints, "robot.joints", "{}"), "robot:\n  joints:\n    {}\n\n# end\nimu: {rate: 1}\n");
}

TEST(EditSettings, WhatCannotBeChangedIsRefusedAndNotSpoilt) {
  for (const std::string feet : {"robot:\n  feet:\n    - name: left\n      sole: &s [1, 2]\n    - name: right\n      sole: *s\n  urdf: a\n",
                                 "robot:\n  feet: [{name: left,  # one ]\n    link: l}, {name: right}]\n  urdf: a\n"})
    EXPECT_THROW(with_setting(feet, "robot.feet", "[]"), ConfigError) << feet;
}

TEST(EditSettings, AMissingKeyJoinsItsSection) {
  EXPECT_EQ(with_setting(text, "lidar.time_offset", "0.005").substr(text.size() - 18), "lidar:\n  time_offset: 0.005\n  rate: 10\n");
  EXPECT_THROW(with_setting(text, "camera.time_offset", "0.005"), ConfigError);
}

TEST(EditSettings, ARotationReplacesItsOtherSpellings) {
  EXPECT_EQ(with_setting("lidar:\n  T_imu_lidar:\n    p: [0, 0, 0]\n    rpy: [3, 0, 0]\n", "lidar.T_imu_lidar.R", "[1]"),
            "lidar:\n  T_imu_lidar:\n    p: [0, 0, 0]\n    R: [1]\n");
}

}  // namespace edit_settings_test
}  // namespace kilvo::lab
