// Legs are told apart by the tree of the URDF, whatever their names.
#include "lab/doctor/leg_sides.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kilvo::lab {
namespace leg_sides_test {

using testing::ElementsAre;

std::string joint(const std::string& name, const std::string& parent, const std::string& child, const char* type = "revolute") {
  return fmt::format(
      R"(<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="0 0 -0.1"/><axis xyz="0 1 0"/><limit effort="9" velocity="9" lower="-1" upper="1"/></joint>)",
      name, type, parent, child);
}

/// A torso on a pelvis with two legs; the second one is written from the foot up. Each foot carries a sole plate.
Robot robot() {
  Robot out;
  out.urdf = R"(<robot name="r">)";
  for (const char* link : {"torso", "pelvis", "a1", "a2", "a3", "plate_a", "b3", "plate_b", "b2", "b1", "arm"})
    out.urdf += fmt::format(R"(<link name="{}"/>)", link);
  out.urdf += joint("waist", "torso", "pelvis") + joint("shoulder", "torso", "arm") + joint("m7", "pelvis", "a1") +
              joint("m2", "a1", "a2") + joint("m9", "a2", "a3") + joint("m1", "b2", "b3") + joint("m4", "b1", "b2") +
              joint("m3", "pelvis", "b1") + joint("fa", "a3", "plate_a", "fixed") + joint("fb", "b3", "plate_b", "fixed") + "</robot>";
  out.feet[0].link = "plate_a";
  out.feet[1].link = "plate_b";
  return out;
}

TEST(LegSides, AreThoseOfTheTreeWhateverTheNames) {
  const Robot r = robot();
  const LegSides sides(LinkTree(r), r);
  EXPECT_THAT(sides.joints_of(0), ElementsAre("m7", "m2", "m9"));
  EXPECT_THAT(sides.joints_of(1), ElementsAre("m3", "m4", "m1"));
  EXPECT_EQ(sides.other_joint("m2"), "m4");
  EXPECT_EQ(sides.other_joint("m1"), "m9");
  EXPECT_EQ(sides.other_link("plate_b"), "plate_a");
  EXPECT_EQ(sides.other_link("a3"), "b3");
  EXPECT_EQ(sides.leg_of_joint("m9"), 0u);
  EXPECT_EQ(sides.leg_of_link("b1"), 1u);
}

TEST(LegSides, NeitherTheWaistNorAnArmIsOfALeg) {
  const Robot r = robot();
  const LegSides sides(LinkTree(r), r);
  for (const char* name : {"waist", "shoulder", "no such joint"}) {
    EXPECT_EQ(sides.leg_of_joint(name), std::nullopt) << name;
    EXPECT_EQ(sides.other_joint(name), name);
  }
  for (const char* name : {"torso", "pelvis", "arm"}) EXPECT_EQ(sides.leg_of_link(name), std::nullopt) << name;
}

TEST(LegSides, GoOnBelowTheDescribedFeet) {
  Robot r = robot();
  r.feet[0].link = "b2";
  r.feet[1].link = "a2";
  const LegSides sides(LinkTree(r), r);
  EXPECT_EQ(sides.leg_of_joint("m1"), 0u);
  EXPECT_EQ(sides.other_joint("m1"), "m9");
}

TEST(LegSides, AreNoneWhenBothFeetAreOnOneLeg) {
  Robot r = robot();
  r.feet[1].link = "a2";
  const LegSides sides(LinkTree(r), r);
  EXPECT_TRUE(sides.joints_of(0).empty());
  EXPECT_EQ(sides.other_joint("m2"), "m2");
}

}  // namespace leg_sides_test
}  // namespace kilvo::lab
