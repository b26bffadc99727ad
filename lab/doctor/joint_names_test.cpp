#include "lab/doctor/joint_names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kilvo::lab {
namespace joint_names_test {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

TEST(JointNames, OfTheSameWordsMatch) {
  const std::vector<std::string> joints{"left_hip_pitch_joint", "right_knee_joint"};
  for (const auto& names : std::vector<std::vector<std::string>>{{"RightKnee", "neck", "LeftHipPitch"},
                                                                 {"robot/right_knee_joint", "robot/left_hip_pitch_joint"},
                                                                 {"r_knee", "l_hip_pitch"},
                                                                 {"knee_r", "hip_pitch_l"}}) {
    const auto found = matching_names(joints, names);
    EXPECT_THAT(found,
                ElementsAre(Pair("left_hip_pitch_joint", names.size() == 3 ? names[2] : names[1]), Pair("right_knee_joint", names[0])));
  }
  EXPECT_THAT(matching_names(joints, {"right_knee_joint", "LeftHipPitch"}), ElementsAre(Pair("left_hip_pitch_joint", "LeftHipPitch")));
}

TEST(JointNames, ThatMayBeAnotherJointsDoNot) {
  const std::vector<std::string> joints{"left_hip_pitch_joint", "right_knee_joint"};
  EXPECT_THAT(matching_names(joints, {"LeftHipPitch", "LeftKnee"}), IsEmpty()) << "one is missing";
  EXPECT_THAT(matching_names(joints, {"LeftHipPitch", "l_hip_pitch", "RightKnee"}), IsEmpty()) << "two have its words";
  EXPECT_THAT(matching_names({"left_2", "Left2"}, {"l_2"}), IsEmpty()) << "one name for two";
  EXPECT_THAT(matching_names(joints, {}), IsEmpty());
}

}  // namespace joint_names_test
}  // namespace kilvo::lab
