#include "apps/node/base_frame.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/helpers/test_biped.hpp"

namespace kilvo::node {
namespace base_frame_test {

// The IMU is fixed to the torso, which the waist turns against the pelvis, the root.
lab::Settings biped_with_waist() {
  test::Random random(5);
  lab::Settings settings;
  settings.robot = test::biped(random);
  settings.topics[static_cast<std::size_t>(Sensor::legs)] = "/joint_states";
  return settings;
}

Options with_base(const std::string& base) {
  Options options;
  options.base = base;
  return options;
}

TEST(BaseFrame, IsTheRootThroughTheMeasuredWaist) {
  const lab::Settings settings = biped_with_waist();
  BaseFrame frame({}, settings);
  EXPECT_EQ(frame.name(), "pelvis");
  EXPECT_EQ(frame.tf_name(), "pelvis");
  EXPECT_FALSE(frame.newest());
  EXPECT_THAT(frame.waiting_for(), testing::HasSubstr("waist"));
  test::Random random(6);
  const JointSample joints = test::random_joints(random);
  frame.take(joints);
  ASSERT_TRUE(frame.newest());
  EXPECT_EQ(frame.waiting_for(), "");
  EXPECT_LT((frame.newest()->base.T_IL.p - lab::LinkKinematics(settings.robot, "pelvis").at(joints)->T_IL.p).norm(), 1e-15);
}

TEST(BaseFrame, TransformsNeverLeadToALinkBelowTheRoot) {
  const lab::Settings settings = biped_with_waist();
  test::Random random(7);
  const JointSample joints = test::random_joints(random);
  for (const std::string base : {"torso", "link", "left_foot"}) {
    BaseFrame frame(with_base(base), settings);
    EXPECT_EQ(frame.name(), base == "link" ? "torso" : base);
    EXPECT_EQ(frame.tf_name(), "pelvis");
    frame.take(joints);
    ASSERT_TRUE(frame.newest());
    EXPECT_GT((frame.newest()->tf.T_IL.p - frame.newest()->base.T_IL.p).norm(), 0.05);
  }
  // A name that is no link of the robot has no other parent.
  Options own = with_base("imu");
  own.base_frame = "body";
  EXPECT_EQ(BaseFrame(own, settings).tf_name(), "body");
  own.base_frame = "torso";
  EXPECT_EQ(BaseFrame(own, settings).tf_name(), "pelvis");
}

TEST(BaseFrame, WithoutEncodersIsTheImuOrWhatIsRigid) {
  lab::Settings settings = biped_with_waist();
  settings.topics[static_cast<std::size_t>(Sensor::legs)] = "";
  EXPECT_EQ(BaseFrame({}, settings).name(), "base_link");
  EXPECT_EQ(BaseFrame(with_base("torso"), settings).name(), "torso");
  EXPECT_THROW(BaseFrame(with_base("pelvis"), settings), lab::ConfigError);
  EXPECT_THROW(BaseFrame(with_base("pelvi"), settings), lab::ConfigError);
  settings.robot.locked_joints = {"waist"};
  EXPECT_EQ(BaseFrame({}, settings).name(), "pelvis");
  EXPECT_TRUE(BaseFrame({}, settings).newest());
  settings.robot.urdf.clear();
  EXPECT_EQ(BaseFrame({}, settings).name(), "base_link");
}

}  // namespace base_frame_test
}  // namespace kilvo::node
