// The world of a live run is levelled once, while it runs: docs/decisions/live.md.
#include <cstdio>
#include <gtest/gtest.h>

#include "apps/live/levelling.hpp"
#include "lab/evaluation/align.hpp"
#include "tests/live/lived.hpp"

namespace kilvo {
namespace level_test {

constexpr double bias = 0.07, tilt = bias / 9.81;  // m/s^2, rad

struct Errors {
  double z = 0, position = 0;  // rms, m
};

Errors errors_of(const std::vector<lab::PosePair>& pairs, lab::Alignment alignment) {
  const SE3 T_GE = lab::align(pairs, alignment);
  double z = 0, all = 0;
  for (const lab::PosePair& pair : pairs) {
    const Eigen::Vector3d e = T_GE * pair.T_E.p - pair.T_G.p;
    z += e.z() * e.z();
    all += e.squaredNorm();
  }
  const auto n = static_cast<double>(pairs.size());
  return {std::sqrt(z / n), std::sqrt(all / n)};
}

Output as_it_began(Output o) {
  if (o.R_LW) Levelling::apply(o.R_LW->inverse(), o);
  return o;
}

class LevelLive : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    walk_ = std::make_unique<test::FailingWalk>("room", 1, 26, false, [](lab::SimulatorConfig& c) { c.imu.accel_bias_sigma = 0; });
    lived_ = test::live_through(*walk_, {}, 1, [](Measurement& m) {
      if (auto* imu = std::get_if<ImuSample>(&m)) imu->accel.x() += bias;
    });
  }
  static void TearDownTestSuite() { walk_.reset(); }
  static std::vector<lab::PosePair> pairs(bool level) {
    std::vector<lab::PosePair> out;
    for (const Output& o : lived_.states) {
      if (o.R_LW) out.push_back({o.t, (level ? o : as_it_began(o)).x.pose(), walk_->truth_at(o.t)});
    }
    return out;
  }

  static std::unique_ptr<test::FailingWalk> walk_;
  static test::Lived lived_;
};
std::unique_ptr<test::FailingWalk> LevelLive::walk_;
test::Lived LevelLive::lived_;

TEST_F(LevelLive, IsReportedOnceAndEarlyWithTheTilt) {
  const std::vector<Event> events = lived_.events(Reason::levelled);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events.front().value, tilt, 2e-3) << "gravity counts as known at a sigma of 1e-3 rad";
  EXPECT_LT(events.front().t, walk_->time(12)) << "as soon as the robot turns: straight ahead a bias looks like a tilt";
  EXPECT_EQ(row_of(Reason::levelled).severity, Severity::notice);
}

TEST_F(LevelLive, TheErrorByYawBecomesThatBySe3) {
  const Errors before = errors_of(pairs(false), lab::Alignment::yaw), after = errors_of(pairs(true), lab::Alignment::yaw),
               best = errors_of(pairs(true), lab::Alignment::se3);
  std::printf("z, aligned by yaw: %.2f mm before, %.2f mm after; by se3 %.2f mm; positions %.2f, %.2f, %.2f mm\n", 1e3 * before.z,
              1e3 * after.z, 1e3 * best.z, 1e3 * before.position, 1e3 * after.position, 1e3 * best.position);
  ASSERT_GT(pairs(true).size(), 2000u);
  EXPECT_GT(before.z, 20 * best.z) << "there is something to be put right";
  EXPECT_LT(after.z, before.z / 7) << "gravity counts as known at a sigma of 1e-3 rad, of 7e-3 that it was off";
  EXPECT_LT(after.position, 2 * best.position);
}

TEST_F(LevelLive, TheStepIsTheTurnAndNothingElse) {
  const auto first = std::ranges::find_if(lived_.states, [](const Output& o) { return o.R_LW.has_value(); });
  ASSERT_NE(first, lived_.states.begin());
  ASSERT_NE(first, lived_.states.end());
  for (auto o = first; o != lived_.states.end(); ++o) ASSERT_TRUE(o->R_LW) << "there is no way back";
  const State &then = (first - 1)->x, now = as_it_began(*first).x;
  const double dt = to_seconds(first->t - (first - 1)->t);
  EXPECT_LT((now.p - then.p - dt * then.v).norm(), 1e-3);
  EXPECT_LT((then.R.inverse() * now.R).Log().norm(), 0.01);
  EXPECT_LT(std::abs(first->x.g.head<2>().norm()), 9.81 * 1e-3) << "z is up";
}

TEST_F(LevelLive, CloudsAndGroundAreInTheSameWorld) {
  const Output& sweep = *std::ranges::find_if(lived_.sweeps, [](const Output& o) { return o.is_sweep && o.R_LW; });
  const Output& last = lived_.states.back();
  ASSERT_TRUE(sweep.R_LW && last.contacts);
  EXPECT_LT((sweep.R_LW->inverse() * *last.R_LW).Log().norm(), 1e-12) << "once";
  for (const GroundPatch& patch : last.contacts->ground) EXPECT_GT(patch.normal.z(), std::cos(0.01)) << "the floor is level";
}

}  // namespace level_test
}  // namespace kilvo
