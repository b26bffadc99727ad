// The rules of the paper's Section V, one by one. Equations are the paper's.
#include "lab/contacts/paper_contacts.hpp"

#include <gtest/gtest.h>

#include "kilvo/legs/leg_pipeline.hpp"
#include "lab/contacts/contact_methods.hpp"
#include "tests/helpers/contact_watch.hpp"

namespace kilvo::lab {
namespace paper_contacts_test {

using std::chrono::milliseconds;

constexpr double velocity_noise = 0.003, accel_noise = 0.3;  // m/s, m/s^2

// A walk that is noisy, and whose touchdowns jolt the body by 15 m/s^2 for 12 ms.
struct Walker {
  test::Gait gait{.first = 1.2};
  PaperContactEstimator contacts;
  test::Random random{3};
  std::vector<test::Change> changes;
  bool jolts = true;

  bool jolts_at(double s) const {
    return jolts && ((!gait.stands(0, s - 0.012) && gait.stands(0, s)) || (!gait.stands(1, s - 0.012) && gait.stands(1, s)));
  }
  Eigen::Vector3d accel(double s) {
    return Eigen::Vector3d(0, 0, standard_gravity) + random.vector3(s < gait.first ? 0.02 : accel_noise) +
           (jolts_at(s) ? Eigen::Vector3d(3, 3, 15) : Eigen::Vector3d::Zero());
  }
  void step(const Feet& feet, const State& x, const Eigen::Vector3d& a, double s) {
    const std::array<bool, 2> before = contacts.contacts().on;
    const Contacts& now = contacts.update(feet, x, Eigen::Vector3d::Zero(), a);
    for (std::size_t side = 0; side < 2; ++side) {
      if (now.on[side] != before[side]) changes.push_back({side, now.on[side], s});
    }
  }
  Feet feet(double s) {
    Feet out = gait.feet(s);
    for (FootPose& foot : out.foot) {
      const Eigen::Vector3d noise = random.vector3(velocity_noise);
      for (auto& v : foot.v) v += noise;
    }
    return out;
  }
  void walk(double from, double to, double rate = 1000) {
    for (int i = 0; from + i / rate < to; ++i) {
      const double s = from + i / rate;
      step(feet(s), gait.body(s), accel(s), s);
    }
  }
};

TEST(SignalStatistics, MeanAndDeviationAreOfThePopulation) {  // Eq. 17
  SignalStatistics<2> statistics;
  for (const double z : {1.0, 2.0, 3.0, 6.0}) statistics.add({z, 7});
  EXPECT_DOUBLE_EQ(statistics.mean()[0], 3);
  EXPECT_NEAR(statistics.sigma(1e-3)[0], std::sqrt(14.0 / 4), 1e-12);
  EXPECT_DOUBLE_EQ(statistics.sigma(1e-3)[1], 1e-3);
  EXPECT_NEAR(statistics.deviation({5, 7.002}, 1e-3).sum(), 2 / std::sqrt(3.5) + 2, 1e-9);  // Eq. 19
}

TEST(HeldCue, FiveFramesOfAMillisecondAndThreeSamplesAtLeast) {
  const auto samples_until = [](Duration period) {
    HeldCue cue;
    int n = 0;
    do ++n;
    while (!cue.update(true, time_from_ns(0) + n * period) && n < 100);
    return n;
  };
  EXPECT_EQ(samples_until(milliseconds(1)), 5);
  EXPECT_EQ(samples_until(std::chrono::microseconds(500)), 8);
  EXPECT_EQ(samples_until(milliseconds(10)), 3);
  HeldCue cue;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(cue.update(true, time_from_ns(0) + milliseconds(i)));
  EXPECT_FALSE(cue.update(false, time_from_ns(0) + milliseconds(4)));
  EXPECT_FALSE(cue.update(true, time_from_ns(0) + milliseconds(5)));
}

TEST(PaperContacts, TheFirstStepGivesTheSwingTime) {  // Section V-A
  Walker walker;
  walker.walk(0, 1.2);
  EXPECT_TRUE(walker.changes.empty());
  EXPECT_FALSE(walker.contacts.swing_time());
  walker.walk(1.2, 1.65);
  EXPECT_TRUE(walker.contacts.swing_time());
  EXPECT_NEAR(to_seconds(*walker.contacts.swing_time()), walker.gait.swing, 0.03);
}

TEST(PaperContacts, AWalkIsReportedFromItsFirstStep) {
  Walker walker;
  walker.walk(0, 6);
  test::expect_changes(walker.gait, walker.changes, 1.2, 5.5, 0.01, 0.03);
}

TEST(PaperContacts, WithoutJoltsTheFallingTrendSetsTheFootDown) {
  Walker walker;
  walker.jolts = false;
  walker.walk(0, 6);
  test::expect_changes(walker.gait, walker.changes, 1.2, 5.5, 0.01, 0.04);
}

TEST(PaperContacts, TheSameAtTwoHundredHertz) {
  Walker walker;
  walker.walk(0, 6, 200);
  test::expect_changes(walker.gait, walker.changes, 1.2, 5.5, 0.01, 0.04);
}

TEST(PaperContacts, AJoltInMidSwingSetsNoFootDown) {  // the swing peak
  Walker walker;
  walker.walk(0, 1.2 + 2 * walker.gait.cycle() + 0.1);
  ASSERT_FALSE(walker.contacts.contacts().on[0]);
  const double s0 = 1.2 + 2 * walker.gait.cycle() + 0.1;
  for (int i = 0; i < 30; ++i) {
    const double s = s0 + 1e-3 * i;
    walker.step(walker.feet(s), walker.gait.body(s), {5, 5, 40}, s);
    EXPECT_GT(walker.contacts.contacts().d_a, unusual_deviation);
    EXPECT_FALSE(walker.contacts.contacts().on[0]) << i;
  }
}

TEST(PaperContacts, AFootIsNotLiftedBeforeTheAccelerationHasSettled) {
  Walker walker;
  const double landed = 1.2 + 2 * walker.gait.cycle() + walker.gait.swing + 0.011;
  walker.walk(0, landed);
  ASSERT_TRUE(walker.contacts.contacts().on[0]);
  // It shakes on, and the foot moves: no lift-off. As soon as it is calm: lift-off.
  const auto moving = [&](double s) {
    Feet feet = walker.feet(s);
    for (auto& v : feet.foot[0].v) v.z() += 0.5;
    return feet;
  };
  walker.changes.clear();
  double s = landed;
  for (int i = 0; i < 40; ++i, s += 1e-3) walker.step(moving(s), walker.gait.body(s), {5, 5, 40}, s);
  EXPECT_TRUE(walker.contacts.contacts().on[0]);
  for (int i = 0; i < 12; ++i, s += 1e-3) walker.step(moving(s), walker.gait.body(s), {0, 0, standard_gravity}, s);
  EXPECT_FALSE(walker.contacts.contacts().on[0]);
  EXPECT_TRUE(walker.contacts.contacts().on[1]);
}

TEST(PaperContacts, ANewStartKeepsTheStatistics) {
  Walker walker;
  walker.walk(0, 3);
  const auto known = walker.contacts.swing_time();
  walker.contacts.restart();
  walker.changes.clear();
  walker.walk(3, 3 + 1e-3);
  EXPECT_TRUE(walker.contacts.contacts().on[0] && walker.contacts.contacts().on[1]);
  EXPECT_EQ(walker.contacts.swing_time(), known);
  walker.walk(3 + 1e-3, 6);
  test::expect_changes(walker.gait, walker.changes, 4, 5.5, 0.01, 0.03);
}

TEST(PaperContacts, AMapOfContactsFollowsTheirSlope) {  // KI: the ground patch from three contacts or more
  test::Gait gait{.first = 1.2};
  Walker walker;
  const double slope = 0.1;  // 5.7 degrees up along x
  const auto raise = [&](Feet feet, const State& x) {
    for (FootPose& foot : feet.foot) {
      for (auto& p : foot.p) p.z() += slope * (x.p.x() + p.x());
      for (auto& v : foot.v) v.z() += slope * (x.v.x() + v.x());
    }
    return feet;
  };
  for (int i = 0; i < 6000; ++i) {
    const double s = 1e-3 * i;
    walker.step(raise(walker.feet(s), gait.body(s)), gait.body(s), walker.accel(s), s);
  }
  for (std::size_t side = 0; side < 2; ++side) {
    ASSERT_TRUE(walker.contacts.contact_patch(side));
    const Eigen::Vector3d n = walker.contacts.contact_patch(side)->normal;
    EXPECT_NEAR(-n.x() / n.z(), slope, 0.02);
  }
}

// What the rows of a supporting foot get, once it is known what they are in a swing.
TEST(PaperContacts, EachRowIsLoosenedByItsOwnDeviation) {  // Eq. 8
  Walker walker;
  PaperContactEstimator::Residual far;
  far << 0.001, 0.5, 0, 1e-4, 0.015, 0, 0;
  EXPECT_TRUE(walker.contacts.row_scale(far).isOnes());
  test::Random random(5);
  for (int i = 0; i < 1700; ++i) {
    const double s = 1e-3 * i;
    walker.step(walker.feet(s), walker.gait.body(s), walker.accel(s), s);
    PaperContactEstimator::Residual r;
    for (int k = 0; k < 7; ++k) r[k] = (k < 3 ? 0.01 : 0.001) * random.normal();
    walker.contacts.learn(1, r);
  }
  ASSERT_TRUE(walker.contacts.swing_time());
  const auto scale = walker.contacts.row_scale(far);
  EXPECT_DOUBLE_EQ(scale[0], 1);  // within theta_d deviations
  EXPECT_NEAR(scale[1], 5, 0.5);  // 50 deviations
  EXPECT_DOUBLE_EQ(scale[3], 1);
  EXPECT_NEAR(scale[4], 1.5, 0.15);  // 15 deviations
  far[2] = 10;
  EXPECT_DOUBLE_EQ(walker.contacts.row_scale(far)[2], largest_scale);
}

TEST(ContactMethods, AreMadeByTheNameOfTheSetting) {
  LegConfig config;
  EXPECT_NO_THROW(OwnedDetector{config});
  EXPECT_EQ(contact_method("kilvo"), nullptr);
  EXPECT_NE(dynamic_cast<PaperContactEstimator*>(contact_method("paper")().get()), nullptr);
  EXPECT_TRUE(contact_method("force")()->needs_forces());
  EXPECT_FALSE(contact_method("variance")()->needs_forces());
  const auto error_of = [](auto&& what) -> std::string {
    try {
      what();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_NE(error_of([] { contact_method("papper"); }).find("legs.contact"), std::string::npos);
  config.contact = "paper";
  EXPECT_NE(error_of([&] { OwnedDetector detector(config); }).find("legs.contact"), std::string::npos) << "without what makes it";
}

TEST(ContactMethods, ACopyIsIndependentAndAnAssignedOneIsTheSame) {
  const test::Gait gait;
  const auto follow = [&gait](ContactDetector& detector, int from, int until) {
    for (int i = from; i < until; ++i)
      detector.update(gait.feet(1e-3 * i), gait.body(1e-3 * i), Eigen::Vector3d::Zero(), {0, 0, standard_gravity});
    return detector.contacts().t;
  };
  for (const char* name : {"kilvo", "paper", "variance", "force"}) {
    LegConfig config;
    config.contact = name;
    config.detector = contact_method(name);
    LegPipeline pipeline(config);
    OwnedDetector first(config);
    follow(*first.operator->(), 0, 100);
    OwnedDetector copy = first;
    const Time then = copy->contacts().t;
    EXPECT_EQ(then, first->contacts().t) << name;
    EXPECT_GT(follow(*first.operator->(), 100, 200), then);
    EXPECT_EQ(copy->contacts().t, then);
    copy = first;
    EXPECT_EQ(copy->contacts().t, first->contacts().t);
  }
}

// With the paper's detector each row of a standing foot has its own factor, with ours none.
TEST(ContactMethods, OnlyThePapersAdaptsRowByRow) {
  for (const char* name : {"kilvo", "paper"}) {
    LegConfig config;
    config.contact = name;
    config.detector = contact_method(name);
    OwnedDetector detector(config);
    StanceTracker tracker(config);
    const test::Gait gait;
    LegStep step;
    for (int i = 0; i < 100; ++i) {
      const State x = gait.body(1e-3 * i);
      const Contacts& now = detector->update(gait.feet(1e-3 * i), x, Eigen::Vector3d::Zero(), {0, 0, standard_gravity});
      step = tracker.step(gait.feet(1e-3 * i), now, x, Eigen::Vector3d::Zero());
      detector->adapt(step, x, Eigen::Vector3d::Zero(), {true, config.ground_sigma});
    }
    ASSERT_TRUE(step.foot[0].used);
    EXPECT_EQ(step.foot[0].row_scale.has_value(), std::string(name) == "paper");
  }
}

}  // namespace paper_contacts_test
}  // namespace kilvo::lab
