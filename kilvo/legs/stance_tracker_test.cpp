// Stances in a filter: what standing, rolling, slipping and stepping feet do to a state that is predicted and updated with them.
#include "kilvo/legs/stance_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <optional>

#include "kilvo/filter/predict.hpp"
#include "kilvo/filter/update.hpp"
#include "tests/helpers/surface_groups.hpp"
#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo {
namespace {

using test::SoleMotion;

const ImuSample level_imu = {Time{}, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, standard_gravity)};

// A body that goes on evenly without turning, over feet that do what `sole` says.
struct Scene {
  std::function<SoleMotion(std::size_t side, double s)> sole;
  Eigen::Vector3d v = {0.1, 0, 0};  // of the body, m/s
  State body(double s) const { return test::body_at(Eigen::Vector3d(0, 0, 0.75) + s * v, v); }
};

SoleMotion standing(std::size_t side) { return {{0, side == 0 ? 0.1 : -0.1, 0}}; }

// 0 before `from`, smoothly 1 after `from` + `ramp`, smoothly 0 again at `to`; and its integral from the beginning.
struct Pulse {
  double from, to, ramp;
  double at(double s) const {
    const auto smooth = [](double u) { return std::clamp(u, 0.0, 1.0) * std::clamp(u, 0.0, 1.0) * (3 - 2 * std::clamp(u, 0.0, 1.0)); };
    return smooth((s - from) / ramp) * smooth((to - s) / ramp);
  }
  double integral(double s) const {
    constexpr int steps = 400;
    double sum = 0;
    const double end = std::clamp(s, from, to), h = (end - from) / steps;
    for (int i = 0; i < steps; ++i) sum += at(from + (i + 0.5) * h) * h;
    return sum;
  }
};

class Filter {
 public:
  explicit Filter(const Scene& scene) : scene_(scene), contacts_(config_), tracker_(config_) {
    e.t = test::gait_begin;
    e.x = scene.body(0);
    e.P.diagonal().segment<3>(at::R).setConstant(1e-6);
    e.P.diagonal().segment<3>(at::v).setConstant(1e-4);
    e.P.diagonal().segment<3>(at::bg).setConstant(1e-8);
    e.P.diagonal().segment<3>(at::ba).setConstant(1e-4);
  }

  // As Replay does it.
  void run(double to, double rate = 1000) {
    for (; now_ < to - 1e-9; now_ += 1 / rate) {
      const State truth = scene_.body(now_);
      Feet feet;
      feet.t = test::gait_begin + from_seconds(now_);
      for (std::size_t side = 0; side < 2; ++side) feet.foot[side] = test::seen_from(truth, scene_.sole(side, now_));
      FootOrientations stances;
      for (std::size_t side = 0; side < 2; ++side) {
        if (last.foot[side].used) stances[side] = last.foot[side].R_IF;
      }
      e = predict(e, ImuInterval::hold(level_imu, e.t, feet.t), stances, {});
      const Eigen::Vector3d omega = -e.x.bg;
      contacts_.update(feet, e.x, omega, level_imu.accel - e.x.ba);
      last = tracker_.step(feet, contacts_.contacts(), e.x, omega);
      for (std::size_t side = 0; side < 2; ++side) {
        if (last.foot[side].ends) end_stance(e, side);
        if (last.foot[side].begins) begin_stance(e, side, last.foot[side].point, config_);
        if (last.foot[side].used && !last.foot[side].begins) move_stance(e, side, last.foot[side].shift);
        begins[side] += last.foot[side].begins ? 1 : 0;
        ends[side] += last.foot[side].ends ? 1 : 0;
      }
      LegModel model(last, level_imu.gyro, config_);
      e = update(e, model, {}).posterior;
      ASSERT_TRUE(is_finite(e));
    }
  }

  Eigen::Vector3d error() const { return e.x.p - scene_.body(to_seconds(e.t - test::gait_begin)).p; }
  const ContactEstimator& contacts() const { return contacts_; }
  StanceTracker& tracker() { return tracker_; }

  Estimate e;
  LegStep last;
  std::array<int, 2> begins = {0, 0}, ends = {0, 0};

 private:
  LegConfig config_;
  Scene scene_;
  double now_ = 0;
  ContactEstimator contacts_;
  StanceTracker tracker_;
};

TEST(StanceTracker, FeetThatStandStillPullAWrongVelocityToTheTruth) {
  Filter filter({[](std::size_t side, double) { return standing(side); }});
  filter.e.x.v += Eigen::Vector3d(0.06, -0.04, 0.03);
  filter.e.P.diagonal().segment<3>(at::v).setConstant(0.01);
  filter.run(0.3);
  EXPECT_LT((filter.e.x.v - Eigen::Vector3d(0.1, 0, 0)).norm(), 0.003);
  EXPECT_LT(std::sqrt(filter.e.P.block<3, 3>(at::v, at::v).trace()), 0.04) << "it was 0.17";
  EXPECT_LT(filter.error().norm(), 0.001);
}

TEST(StanceTracker, FeetThatStandStillKeepThePositionAndFindTheTilt) {
  Filter filter({[](std::size_t side, double) { return standing(side); }});
  filter.e.x.R = SO3::Exp({0.004, -0.003, 0});
  filter.e.P.diagonal().segment<3>(at::R).setConstant(1e-4);
  filter.run(3);
  const Eigen::Vector3d up = filter.e.x.R * Eigen::Vector3d::UnitZ();
  EXPECT_LT(std::hypot(up.x(), up.y()), 0.002) << "it was 0.005";
  EXPECT_LT(filter.error().norm(), 0.01);
}

// The left sole rolls over its front edge while the right foot is in the air.
struct Roll {
  double rate;  // rad/s
  Pulse pulse = {1.3, 1.7, 0.05};
  Pulse flight = {1.0, 2.0, 0.02};

  SoleMotion operator()(std::size_t side, double s) const {
    SoleMotion out = standing(side);
    if (side == 1) {
      out.p.x() += 1.5 * flight.integral(s);
      out.v.x() = 1.5 * flight.at(s);
      return out;
    }
    out.pitch = rate * pulse.integral(s);
    out.pitch_rate = rate * pulse.at(s);
    const Eigen::Vector3d edge(test::sole_front, 0, 0), arm = SO3::Exp({0, out.pitch, 0}) * edge;
    out.p += edge - arm;
    out.v = -Eigen::Vector3d(0, out.pitch_rate, 0).cross(arm);
    return out;
  }
};

TEST(StanceTracker, ASoleThatRollsOverItsFrontEdgeIsHeldByTheEdge) {
  for (const double rate : {1.0, 2.0}) {
    SCOPED_TRACE(rate);
    Filter filter({Roll{rate}});
    filter.run(1.29);
    ASSERT_TRUE(filter.contacts().contacts().on[0]);
    ASSERT_FALSE(filter.contacts().contacts().on[1]);
    const Eigen::Vector3d before = filter.error();
    EXPECT_NEAR(filter.e.x.pc[0].x(), (test::sole_front + test::sole_back) / 2, 0.003) << "the middle of the sole";
    filter.run(1.5);
    EXPECT_NEAR(filter.e.x.pc[0].x(), test::sole_front, 0.003);
    EXPECT_NEAR(filter.e.x.pc[0].z(), 0, 0.002);
    filter.run(1.7);
    EXPECT_TRUE(filter.contacts().contacts().on[0]) << "its edge stands";
    EXPECT_EQ(filter.begins[0], 1);
    EXPECT_LT((filter.error() - before).norm(), 0.001);
  }
}

TEST(StanceTracker, AFootThatSlipsWhileTheOtherStandsCostsHalfOfItsWayAtMost) {
  for (const double speed : {0.05, 0.1, 0.3, 1.0}) {
    SCOPED_TRACE(speed);
    const Pulse slip = {1.0, 1.3, 0.02};
    Filter filter({[=](std::size_t side, double s) {
      SoleMotion out = standing(side);
      if (side == 1) return out;
      out.p.y() += speed * slip.integral(s);
      out.v.y() = speed * slip.at(s);
      return out;
    }});
    filter.run(1.0);
    const Eigen::Vector3d before = filter.error();
    filter.run(2.0);
    EXPECT_LT((filter.error() - before).norm(), 0.5 * speed * slip.integral(2.0) + 0.002);
    EXPECT_LT((filter.e.x.v - Eigen::Vector3d(0.1, 0, 0)).norm(), 0.01);
    EXPECT_TRUE(filter.tracker().standing(0)) << "and it is used again";
  }
}

TEST(StanceTracker, WhenTheOnlyStandingFootSlipsItsWayIsAllThatIsLost) {
  const Pulse flight = {1.0, 2.0, 0.02}, slip = {1.3, 1.6, 0.02};
  for (const double speed : {0.05, 0.1, 0.3}) {
    SCOPED_TRACE(speed);
    Filter filter({[=](std::size_t side, double s) {
      SoleMotion out = standing(side);
      if (side == 1) {
        out.p.x() += 1.5 * flight.integral(s);
        out.v.x() = 1.5 * flight.at(s);
      } else {
        out.p.y() += speed * slip.integral(s);
        out.v.y() = speed * slip.at(s);
      }
      return out;
    }});
    filter.run(1.3);
    const Eigen::Vector3d before = filter.error();
    filter.run(1.9);
    EXPECT_LT((filter.error() - before).norm(), speed * slip.integral(1.9) + 0.005);
    EXPECT_LT((filter.e.x.v - Eigen::Vector3d(0.1, 0, 0)).norm(), 0.5 * speed) << "the velocity is being found again";
  }
}

TEST(StanceTracker, RowsAreADensityOneKilohertzSaysNoMoreThan200Hertz) {
  const Scene scene{[](std::size_t side, double) { return standing(side); }};
  Filter fast(scene), slow(scene);
  fast.run(1, 1000);
  slow.run(1, 200);
  const ErrorVector a = fast.e.P.diagonal(), b = slow.e.P.diagonal();
  for (int i = 0; i < at::ba; ++i) EXPECT_NEAR(a[i] / b[i], 1, 0.1) << "error state " << i;
  const auto to_the_foot = [](const Covariance& P) {
    const auto of = [&P](int row, int col) { return P.block<3, 3>(row, col).trace(); };
    return of(at::p, at::p) + of(at::pcl, at::pcl) - 2 * of(at::p, at::pcl);
  };
  EXPECT_NEAR(to_the_foot(fast.e.P) / to_the_foot(slow.e.P), 1, 0.12);
}

TEST(StanceTracker, AFootEntersAfterItsDelayLooselyAndLeavesWithItsContact) {
  test::Gait gait;
  LegConfig config;
  ContactEstimator contacts(config);
  StanceTracker tracker(config);
  std::array<bool, 2> inside = {false, false};
  int entered = 0, left = 0, loose = 0;
  for (int i = 0; i < 6000; ++i) {
    const double s = 1e-3 * i;
    const Feet feet = gait.feet(s);
    contacts.update(feet, gait.body(s), Eigen::Vector3d::Zero(), level_imu.accel);
    const LegStep step = tracker.step(feet, contacts.contacts(), gait.body(s), Eigen::Vector3d::Zero());
    EXPECT_TRUE(i == 0 || std::abs(step.dt - 1e-3) < 1e-12);
    for (std::size_t side = 0; side < 2; ++side) {
      const Stance& foot = step.foot[side];
      EXPECT_EQ(foot.used, tracker.standing(side));
      EXPECT_EQ(foot.begins, foot.used && !inside[side]);
      EXPECT_EQ(foot.ends, !foot.used && inside[side]);
      if (foot.begins && i > 100) {
        EXPECT_GT(foot.variance_scale, 9);
        EXPECT_NEAR(contacts.contacts().phase(side), config.entry_delay, 0.0011);
        ++entered;
      }
      left += foot.ends ? 1 : 0;
      const bool settled = foot.used && contacts.contacts().phase(side) > 0.1 && gait.stands(side, s);
      const auto& load = contacts.contacts().load;
      const double lighter = step.foot[1 - side].used ? std::max(1.0, load[1 - side] / std::max(0.01, load[side])) : 1.0;
      loose += settled && foot.variance_scale > 1.1 * lighter ? 1 : 0;
      inside[side] = foot.used;
    }
  }
  EXPECT_GE(entered, 10);
  EXPECT_GE(left, entered);
  EXPECT_LT(loose, 20) << "of 12000: some in doubt as the other foot comes down";
}

TEST(StanceTracker, AFootThatIsBeyondItsGateForLongEntersAnewWhereItIs) {
  LegConfig config;
  ContactEstimator contacts(config);
  StanceTracker tracker(config);
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  int ended = 0, began_again = 0;
  for (int i = 0; i < 400; ++i) {
    Feet feet;
    feet.t = test::gait_begin + from_seconds(1e-3 * i);
    feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
    contacts.update(feet, body, Eigen::Vector3d::Zero(), level_imu.accel);
    const LegStep step = tracker.step(feet, contacts.contacts(), body, Eigen::Vector3d::Zero());
    const bool off = i >= 100 && i < 125;
    tracker.judge(step, {!off, true});
    EXPECT_TRUE(step.foot[0].used && step.foot[1].used) << "a foot carries";
    EXPECT_EQ(step.foot[0].ends, i > 0 && step.foot[0].begins);
    ended += step.foot[0].ends ? 1 : 0;
    began_again += i > 0 && step.foot[0].begins ? 1 : 0;
  }
  EXPECT_EQ(ended, 1);
  EXPECT_EQ(began_again, 1);
}

TEST(StanceTracker, WhenNoFootIsBelievedTheMoreProbableCarriesUnlessTheBodyFalls) {
  StanceTracker tracker{LegConfig{}};
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  Feet feet;
  feet.t = test::gait_begin;
  feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
  Contacts contacts;
  contacts.t = feet.t;
  contacts.on = {false, false};
  contacts.probability = {0.2, 0.4};
  const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
  EXPECT_FALSE(step.foot[0].used);
  ASSERT_TRUE(step.foot[1].used);
  EXPECT_GE(step.foot[1].variance_scale, 2) << "believed as far as it is probable";
  contacts.flight = true;
  feet.t += std::chrono::milliseconds(1);
  const LegStep flying = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
  EXPECT_FALSE(flying.foot[0].used || flying.foot[1].used);
}

TEST(StanceTracker, OfTwoFeetThatStandTheLighterOneCountsByItsLoadAndOneAloneInFull) {
  const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
  const auto scales = [&body](double left, bool right_stands) {
    StanceTracker tracker{LegConfig{}};
    Feet feet;
    feet.t = test::gait_begin;
    feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
    Contacts contacts;
    contacts.t = feet.t;
    contacts.since.fill(feet.t - std::chrono::seconds(1));
    contacts.on[1] = right_stands;
    contacts.load = {left, 1 - left};
    const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
    return std::array{step.foot[0].variance_scale, step.foot[1].variance_scale};
  };
  EXPECT_NEAR(scales(0.5, true)[0], 1, 1e-9);
  EXPECT_NEAR(scales(0.5, true)[1], 1, 1e-9);
  EXPECT_NEAR(scales(0.2, true)[0], 4, 1e-9);
  EXPECT_NEAR(scales(0.2, true)[1], 1, 1e-9);
  EXPECT_NEAR(scales(0.0, true)[0], 100, 1e-9) << "bounded";
  EXPECT_NEAR(scales(0.2, false)[0], 1, 1e-9) << "it carries all";
}

TEST(StanceTracker, AtALowRateAFootDoesNotWaitForASampleMoreThanItsDelay) {
  for (const double rate : {50.0, 100.0, 1000.0}) {
    LegConfig config;
    StanceTracker tracker(config);
    const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
    Feet feet;
    feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
    Contacts contacts;
    contacts.since.fill(test::gait_begin - std::chrono::seconds(1));
    std::optional<double> entered;
    for (int i = -5; !entered && i < 100; ++i) {
      contacts.t = feet.t = test::gait_begin + from_seconds(i / rate);
      contacts.on[1] = i >= 0;
      if (i == 0) contacts.since[1] = feet.t;
      const LegStep step = tracker.step(feet, contacts, body, Eigen::Vector3d::Zero());
      if (step.foot[1].used) entered = i / rate;
    }
    ASSERT_TRUE(entered);
    // It came down between the sample that shows it and the one before.
    EXPECT_LE(*entered, config.entry_delay + 1e-9) << rate << " Hz";
    EXPECT_GE(*entered + 1 / rate, config.entry_delay - 1e-9) << rate << " Hz";
  }
}

TEST(StanceTracker, AFootWhoseEncodersAreFrozenWhileTheBodyTurnsIsNotUsed) {
  for (const double rate : {0.0, 0.5}) {
    LegConfig config;
    ContactEstimator contacts(config);
    StanceTracker tracker(config);
    const State body = test::body_at({0, 0, 0.75}, Eigen::Vector3d::Zero());
    LegStep step;
    for (int i = 0; i < 300; ++i) {
      Feet feet;
      feet.t = test::gait_begin + from_seconds(1e-3 * i);
      feet.foot = {test::seen_from(body, standing(0)), test::seen_from(body, standing(1))};
      feet.foot[1].p[0].x() += 1e-9 * i;
      contacts.update(feet, body, Eigen::Vector3d::Zero(), level_imu.accel);
      step = tracker.step(feet, contacts.contacts(), body, Eigen::Vector3d(0, 0, rate));
    }
    EXPECT_EQ(step.foot[0].used, rate == 0) << "a robot at rest may repeat itself";
    EXPECT_EQ(tracker.standing(1), true);
  }
}

TEST(StanceTracker, TheGroundCountsOnceAtEachTouchdownAndOnlyWhereThereIsAMap) {
  const MapConfig map_config;
  VoxelMap map(map_config);
  const auto floor = test::groups_of(test::points_on({-1, -1, 0}, {5, 0, 0}, {0, 2, 0}, 0.04), map_config.voxel_size / 4, 1e-5);
  for (int i = 0; i < 3; ++i) map.insert(floor, 0);
  test::Gait gait;
  for (const VoxelMap* ground : {static_cast<const VoxelMap*>(nullptr), static_cast<const VoxelMap*>(&map)}) {
    LegConfig config;
    ContactEstimator contacts(config);
    StanceTracker tracker(config);
    int entered = 0, with_ground = 0;
    for (int i = 0; i < 4000; ++i) {
      const double s = 1e-3 * i;
      const Feet feet = gait.feet(s);
      contacts.update(feet, gait.body(s), Eigen::Vector3d::Zero(), level_imu.accel);
      const LegStep step = tracker.step(feet, contacts.contacts(), gait.body(s), Eigen::Vector3d::Zero(), 0, ground);
      for (const Stance& foot : step.foot) {
        entered += foot.begins ? 1 : 0;
        with_ground += foot.ground ? 1 : 0;
        EXPECT_TRUE(!foot.ground || (foot.begins && std::abs(foot.ground->height_of({2, 0, 0})) < 0.005));
      }
    }
    EXPECT_GT(entered, 5);
    EXPECT_EQ(with_ground, ground == nullptr ? 0 : entered);
  }
}

TEST(StanceTracker, AfterARestartBothFeetLeaveAndEnterAnewInOneStep) {
  Filter filter({[](std::size_t side, double) { return standing(side); }});
  filter.run(0.2);
  filter.tracker().restart();
  filter.run(0.4);
  EXPECT_EQ(filter.begins, (std::array<int, 2>{2, 2}));
  EXPECT_EQ(filter.ends, (std::array<int, 2>{1, 1}));
  EXPECT_LT(filter.error().norm(), 0.001);
}

}  // namespace
}  // namespace kilvo
