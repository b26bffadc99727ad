#include "lab/messages/joint_assembly.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <span>

namespace kilvo::lab {
namespace joint_assembly_test {

using testing::ElementsAre;

const Time begin = time_from_ns(1'700'000'000'000'000'000);
const JointNames left{"left_hip", "left_knee"}, right{"right_hip", "right_knee"}, both{"left_hip", "left_knee", "right_hip", "right_knee"};

Time at(double ms) { return begin + from_seconds(1e-3 * ms); }

/// Of joints that all turn at 2 rad/s.
JointSample part(const JointNames& names, double ms, bool with_velocity = true) {
  const auto all = [&names](double value) { return std::vector<double>(names.size(), value); };
  return {at(ms), names, all(0.002 * ms), with_velocity ? all(2) : std::vector<double>{}, {}};
}

/// What comes out, each part arriving at its stamp.
std::vector<JointSample> joined(JointAssembly& assembly, const std::vector<JointSample>& messages) {
  std::vector<JointSample> out;
  for (const JointSample& m : messages) {
    if (auto whole = assembly.join(m, m.t)) out.push_back(*std::move(whole));
  }
  return out;
}

TEST(JointAssembly, OfWholeMessagesEachIsGivenBackAsItIs) {
  JointAssembly assembly(both);
  const JointNames order{"right_knee", "head", "right_hip", "left_knee", "left_hip"};
  for (double ms = 0; ms < 20; ms += 2) {
    const auto out = joined(assembly, {part(order, ms)});
    ASSERT_EQ(out.size(), 1U);
    EXPECT_EQ(out[0].names, order);
    EXPECT_EQ(out[0].position, part(order, ms).position);
  }
}

TEST(JointAssembly, WithoutNamesThatItNeedsNothingIsJoined) {
  JointAssembly assembly;
  EXPECT_EQ(joined(assembly, {part(left, 0), part(right, 0)}).size(), 2U);
}

TEST(JointAssembly, TwoLegsOfOneTimeMakeOneSample) {
  JointAssembly assembly(both);
  std::vector<JointSample> messages;
  for (double ms = 0; ms < 20; ms += 2) {
    messages.push_back(part(left, ms));
    messages.push_back(part(right, ms));
    messages.back().position = {10, 20};
    messages.back().effort = {1, 2};
  }
  const auto out = joined(assembly, messages);
  ASSERT_EQ(out.size(), 10U);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double ms = 2 * static_cast<double>(i);
    EXPECT_EQ(out[i].t, at(ms));
    EXPECT_EQ(out[i].names, both);
    EXPECT_THAT(out[i].position, ElementsAre(0.002 * ms, 0.002 * ms, 10, 20));
    EXPECT_THAT(out[i].velocity, ElementsAre(2, 2, 2, 2));
    EXPECT_TRUE(out[i].effort.empty()) << "of one leg only";
  }
  EXPECT_EQ(assembly.unused(), 0U);
}

TEST(JointAssembly, LegsOfDifferentTimesAreBroughtToTheTimeOfTheNewer) {
  for (const double later : {0.1, 0.5, 1.0, 1.5, 1.9}) {
    for (const bool with_velocity : {true, false}) {
      JointAssembly assembly(both);
      std::vector<JointSample> messages;
      for (double ms = 0; ms < 100; ms += 2) {
        messages.push_back(part(left, ms, with_velocity));
        messages.push_back(part(right, ms + later, with_velocity));
      }
      const auto out = joined(assembly, messages);
      EXPECT_GE(out.size(), 47U) << later;
      for (std::size_t i = 2; i < out.size(); ++i) {
        EXPECT_GT(out[i].t, out[i - 1].t);
        for (const double q : out[i].position) EXPECT_NEAR(q, 2 * to_seconds(out[i].t - begin), 1e-9) << later;
      }
    }
  }
}

TEST(JointAssembly, JitterOfTheStampsCostsFewSamples) {
  JointAssembly assembly(both);
  std::vector<JointSample> messages;
  for (int i = 0; i < 500; ++i) {  // stamps 0.6 ms early to 0.6 ms late, from no source of chance
    messages.push_back(part(left, 2 * i + 0.6 * std::sin(37.0 * i)));
    messages.push_back(part(right, 2 * i + 0.7 + 0.6 * std::sin(53.0 * i + 1)));
  }
  EXPECT_GE(joined(assembly, messages).size(), 430U);
}

TEST(JointAssembly, VelocitiesThatADriverDoesNotKnowAreLeftOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  JointAssembly assembly(both);
  const auto velocities = [&](double ms, std::vector<double> velocity) {
    JointSample message = part(JointNames{"left_hip", "left_knee", "arm", "right_hip", "right_knee"}, ms);
    message.velocity = std::move(velocity);
    return assembly.join(message, message.t).value_or(JointSample{}).velocity;
  };
  EXPECT_THAT(velocities(0, {0, 0, 1, 0, 0}), ElementsAre(0, 0, 1, 0, 0)) << "it may stand";
  EXPECT_THAT(velocities(0, {0, 0, 1, 0, 0}), ElementsAre(0, 0, 1, 0, 0)) << "it does";
  EXPECT_THAT(velocities(1, {0, 0, 1, 0, 0}), ElementsAre()) << "it moves";
  EXPECT_THAT(velocities(2, {nan, 1, 1, nan, 1}), ElementsAre());
  EXPECT_THAT(velocities(4, {0, 1, nan, 0, 1}).size(), 5U);
  EXPECT_THAT(velocities(6, {0, 0, 0, 0, 0}), ElementsAre(0, 0, 0, 0, 0)) << "a robot that stands";
  EXPECT_THAT(velocities(8, {nan, 0, 0, 0, 0}).size(), 5U) << "is refused, not guessed";
}

TEST(JointAssembly, VelocitiesThatAreNotWantedAreLeftOutOfPartsToo) {
  for (const JointNames& needed : {both, JointNames{}}) {
    JointAssembly assembly(needed, false);
    for (double ms = 0; ms < 20; ms += 2) {
      for (JointSample& whole : joined(assembly, {part(left, ms), part(right, ms + 1)})) EXPECT_TRUE(whole.velocity.empty());
    }
  }
  // Each is brought to the time of the newer one by the change of its positions, whatever its velocity.
  JointAssembly assembly(both, false);
  std::vector<JointSample> messages;
  for (double ms = 0; ms < 20; ms += 2) {
    for (JointSample m : {part(left, ms), part(right, ms + 1)}) {
      for (double& v : m.velocity) v *= 57;
      messages.push_back(m);
    }
  }
  const auto wholes = joined(assembly, messages);
  ASSERT_GT(wholes.size(), 5U);
  for (const JointSample& whole : std::span(wholes).subspan(2)) {
    for (const double q : whole.position) EXPECT_NEAR(q, 2 * to_seconds(whole.t - begin), 1e-9);
  }
}

TEST(JointAssembly, ASlowWaistDoesNotHoldBackFastLegs) {
  const JointNames waist{"waist"}, all{"waist", "left_hip", "left_knee", "right_hip", "right_knee"};
  JointAssembly assembly(all);
  std::vector<JointSample> messages;
  for (int ms = 0; ms < 1000; ms += 2) {
    messages.push_back(part(left, ms));
    messages.push_back(part(right, ms));
    if (ms % 20 == 0) messages.push_back(part(waist, ms));
  }
  const auto out = joined(assembly, messages);
  EXPECT_GE(out.size(), 480U);
  for (std::size_t i = 20; i < out.size(); ++i) EXPECT_NEAR(out[i].position[0], 2 * to_seconds(out[i].t - begin), 1e-9);
}

TEST(JointAssembly, ALostPartCostsOneSample) {
  JointAssembly assembly(both);
  std::vector<JointSample> messages;
  for (int ms = 0; ms < 20; ms += 2) {
    messages.push_back(part(left, ms));
    if (ms != 10) messages.push_back(part(right, ms));
  }
  EXPECT_EQ(joined(assembly, messages).size(), 9U);
  EXPECT_EQ(assembly.unused(), 1U);
}

TEST(JointAssembly, ALegThatStopsEndsTheSamplesAtOnceAndIsNamedLater) {
  JointAssembly assembly(both);
  std::vector<JointSample> messages;
  for (int ms = 0; ms < 3000; ms += 2) {
    messages.push_back(part(left, ms));
    if (ms < 500) messages.push_back(part(right, ms));
  }
  int whole = 0;
  for (const JointSample& m : messages) {
    const auto out = assembly.join(m, m.t);
    if (!out) continue;
    whole += out->names == both ? 1 : 0;
    EXPECT_TRUE(out->names == both ? out->t < at(500) : out->t > at(1498)) << "handed on late, for the estimator to say what is missing";
  }
  EXPECT_EQ(whole, 250);
}

TEST(JointAssembly, ALegThatIsNeverThereIsNamedAfterASecond) {
  JointAssembly assembly(both);
  for (int ms = 0; ms < 3000; ms += 2) EXPECT_EQ(assembly.join(part(left, ms), at(ms)).has_value(), ms > 1000) << ms;
}

TEST(JointAssembly, ArmsBesideLegsAreLeftOutWhoeverComesFirst) {
  const JointNames arms{"left_elbow", "right_elbow"};
  for (const bool in_parts : {true, false}) {
    JointAssembly assembly(both);
    std::vector<JointSample> messages;
    for (int ms = 0; ms < 3000; ms += 2) {
      messages.push_back(part(arms, ms));
      if (in_parts) messages.push_back(part(left, ms));
      messages.push_back(part(in_parts ? right : both, ms));
    }
    const auto out = joined(assembly, messages);
    EXPECT_EQ(out.size(), 1500U);
    for (const JointSample& sample : out) EXPECT_EQ(sample.names, both);
  }
}

TEST(JointAssembly, AnotherRobotsMessagesAreGivenBackAfterASecond) {
  JointAssembly assembly(both);
  for (int ms = 0; ms < 3000; ms += 2) {
    EXPECT_EQ(assembly.join(part({"wheel"}, ms), at(ms)).has_value(), ms > 1000) << ms;
    EXPECT_FALSE(assembly.is_of_legs());
  }
}

TEST(JointAssembly, GoesOnWhenTheTimeStepsBack) {
  JointAssembly assembly(both);
  std::vector<JointSample> messages;
  for (int i = 0; i < 200; ++i) {
    const double ms = i < 100 ? 2 * i + 5000 : 2 * i;
    messages.push_back(part(left, ms));
    messages.push_back(part(right, ms));
  }
  EXPECT_EQ(joined(assembly, messages).size(), 200U);
}

}  // namespace joint_assembly_test
}  // namespace kilvo::lab
