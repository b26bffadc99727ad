// A walk through the live runner, beside the same offline.
#include <algorithm>
#include <cstdio>
#include <gtest/gtest.h>
#include <map>
#include <thread>

#include "apps/live/levelling.hpp"
#include "tests/live/lived.hpp"

namespace kilvo {
namespace walk_test {

using test::live_through;
using test::Lived;
using test::push_and_wait;

std::vector<Output> offline(const test::FailingWalk& walk, std::vector<lab::Failure> failures) {
  std::vector<Output> out;
  EstimatorConfig config = walk.settings().estimator;
  config.wait_for_images = false;
  Estimator estimator(walk.settings().robot, config, walk.used());
  walk.play(std::move(failures), [&](Measurement m) { estimator.push(std::move(m), out); });
  std::ranges::move(estimator.finish(), std::back_inserter(out));
  Levelling levelling;
  for (Output& o : out) {
    levelling.add(o);
    if (levelling.turn()) Levelling::apply(*levelling.turn(), o);
  }
  return out;
}

const test::FailingWalk& walk() {
  static const test::FailingWalk walk("room", 3, 10, true);
  return walk;
}

TEST(LiveWalk, IsTheOfflineOneOnceTheCorrectionsAreIn) {
  const std::vector<Output> expected = offline(walk(), {});
  const Lived lived = live_through(walk(), {});
  std::map<Time, const Output*> at;
  std::vector<const Output*> sweeps;
  for (const Output& o : expected) {
    at[o.t] = &o;
    if (o.is_sweep || o.is_image) sweeps.push_back(&o);
  }
  // Offline a sweep and an image may go out together, where live the one was ready before the other.
  ASSERT_GE(lived.sweeps.size(), sweeps.size());
  ASSERT_LE(lived.sweeps.size(), sweeps.size() + sweeps.size() / 10);
  for (const Output& o : lived.sweeps) {
    ASSERT_TRUE(at.contains(o.t));
    ASSERT_EQ(o.x.p, at.at(o.t)->x.p) << "to the last bit";
  }
  // A scan arrives some milliseconds after its end; until then the live runner cannot know it.
  constexpr Duration arrived = std::chrono::milliseconds(40);
  std::size_t compared = 0, sweep = 0;
  for (const Output& o : lived.states) {
    while (sweep + 1 < sweeps.size() && sweeps[sweep + 1]->t <= o.t) ++sweep;
    const auto same = at.find(o.t);
    if (same == at.end() || o.t < sweeps[sweep]->t + arrived) continue;
    ++compared;
    const State& x = same->second->x;
    ASSERT_LT((o.x.p - x.p).norm(), 1e-3) << "at " << to_seconds(o.t - expected.front().t);
    ASSERT_LT((o.x.R.inverse() * x.R).Log().norm(), 0.05 * M_PI / 180) << "at " << to_seconds(o.t - expected.front().t);
  }
  EXPECT_GT(compared, 1000u);
  EXPECT_EQ(lived.statistics.dropped, (std::array<std::uint64_t, sensor_count>{}));
  EXPECT_EQ(lived.statistics.dropped_outputs, 0u);
  EXPECT_GT(lived.statistics.correction.count(), 50u);
}

TEST(LiveWalk, LateSensorsCostNoMessageAndLittleAccuracy) {
  for (const auto& [sensor, seconds] :
       {std::pair(Sensor::camera, 0.1), std::pair(Sensor::lidar, 0.05), std::pair(Sensor::legs, 0.02), std::pair(Sensor::legs, 0.15)}) {
    const Lived lived = live_through(walk(), {{.kind = lab::FailureKind::delay, .sensor = sensor, .amount = seconds}});
    std::printf("%s %.0f ms late: worst error %.2f mm\n", name_of(sensor), 1e3 * seconds, 1e3 * walk().worst_error(lived.states));
    EXPECT_LT(walk().worst_error(lived.states), 0.006) << name_of(sensor);
    // Late or not, each leg sample (500 Hz, from when it stands) is answered.
    EXPECT_GT(lived.states.size(), 4400u) << name_of(sensor);
    EXPECT_TRUE(lived.statistics.warnings.empty()) << name_of(sensor);
    const auto images = std::ranges::count_if(lived.sweeps, &Output::is_image),
               sweeps = std::ranges::count_if(lived.sweeps, &Output::is_sweep);
    EXPECT_GE(images, 90) << name_of(sensor);
    EXPECT_GE(sweeps, 90) << name_of(sensor);
  }
}

// Share of the feet whose contact is right, over the time that both runs cover.
double right_contacts(const std::vector<Output>& outputs, double from, double until) {
  int right = 0, all = 0;
  for (const Output& o : outputs) {
    const double s = walk().seconds_of(o.t);
    if (!o.contacts || s < from || s > until) continue;
    for (std::size_t side = 0; side < 2; ++side) {
      right += o.contacts->on[side] == walk().truth().in_contact(static_cast<lab::Side>(side), s) ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(all, 4000);
  return static_cast<double>(right) / all;
}

TEST(LiveWalk, ContactsOfLateLegsAreAsGoodAsOffline) {
  const double expected = right_contacts(offline(walk(), {}), 2, 9.5);
  EXPECT_GT(expected, 0.95);
  const Lived lived = live_through(walk(), {{.kind = lab::FailureKind::delay, .sensor = Sensor::legs, .amount = 0.1}});
  const double right = right_contacts(lived.states, 2, 9.5);
  std::printf("legs 100 ms late: contacts %.2f %% right, offline %.2f %%\n", 100 * right, 100 * expected);
  EXPECT_NEAR(right, expected, 0.005);
}

TEST(LiveWalk, ALostSensorIsSaidInTime) {
  using lab::FailureKind;
  const Lived lived = live_through(walk(), {{FailureKind::drop, Sensor::legs, 5, 6, 0}, {FailureKind::drop, Sensor::lidar, 7, 8, 0}});
  const auto said = [&lived](const char* cause) {
    const auto first =
        std::ranges::find(lived.states, std::string_view(cause), [](const Output& o) { return std::string_view(text_of(o.cause)); });
    return first == lived.states.end() ? 1e9 : to_seconds(first->t - walk().time(0));
  };
  // 50 ms, and 0.3 s after the last sweep.
  EXPECT_NEAR(said("legs lost"), 5.05, 0.01);
  EXPECT_NEAR(said("lidar lost"), 7.25, 0.06);
  for (const Output& o : lived.states) {
    const double s = to_seconds(o.t - walk().time(0));
    if (s > 5.06 && s < 6) {
      EXPECT_FALSE(has_legs(o.modality)) << s << ": said once, not taken back";
    }
  }
}

TEST(LiveWalk, ClocksThatGoBackAreFollowed) {
  using lab::FailureKind;
  std::vector<lab::Failure> all;
  for (const Sensor s : {Sensor::imu, Sensor::legs, Sensor::lidar, Sensor::camera})
    all.push_back({FailureKind::time_jump, s, 6, std::numeric_limits<double>::infinity(), -1});
  const Lived lived = live_through(walk(), all);
  EXPECT_GT(lived.states.back().t, walk().time(9.9));
  EXPECT_LT(walk().worst_error(lived.states), 0.006);
  EXPECT_EQ(lived.statistics.warnings.size(), 1u);
  EXPECT_EQ(lived.statistics.clock_steps, 1u);
  const std::vector<Event> events = lived.events(Reason::imu_clock_stepped);
  ASSERT_EQ(events.size(), 1u) << "while it runs";
  EXPECT_NEAR(events.front().value, 1, 0.01);
}

std::vector<Output> of_epoch(const std::vector<Output>& all, std::uint32_t epoch) {
  std::vector<Output> out;
  std::ranges::copy_if(all, std::back_inserter(out), [epoch](const Output& o) { return o.epoch == epoch; });
  return out;
}

TEST(LiveWalk, PlayedASecondTimeBeginsAnew) {
  const Lived lived = live_through(walk(), {}, 2);
  const std::vector<Output> first = of_epoch(lived.states, 0), second = of_epoch(lived.states, 1);
  ASSERT_EQ(first.size() + second.size(), lived.states.size()) << "two epochs";
  ASSERT_GT(second.size(), 4400u) << "as the first time";
  EXPECT_LT(second.front().t, walk().time(2)) << "the stamps are those of the recording";
  EXPECT_LT(walk().worst_error(first), 0.02);
  EXPECT_LT(walk().worst_error(second), 0.02);
  const std::vector<Event> anew = lived.events(Reason::began_anew);
  ASSERT_EQ(anew.size(), 1u);
  EXPECT_NEAR(anew.front().value, 10, 0.2);
  EXPECT_EQ(lived.seen.epochs, 2u);
  EXPECT_FALSE(lived.seen.diverged);
}

TEST(LiveWalk, OutputsAreFiniteAndOrderedWhateverIsLost) {
  using lab::FailureKind;
  const std::vector<std::vector<lab::Failure>> schedules = {
      {{FailureKind::drop, Sensor::legs, 5, 6.5, 0}, {FailureKind::not_a_number, Sensor::imu, 7, 7.05, 0}},
      {{FailureKind::drop, Sensor::imu, 5, 5.5, 0}, {FailureKind::time_jump, Sensor::imu, 7, 7.02, 3}},
      {{FailureKind::drop, Sensor::lidar, 5, 7, 0}, {FailureKind::not_a_number, Sensor::legs, 6, 6.3, 0}},
      {{FailureKind::freeze, Sensor::imu, 6, 6.5, 0}, {FailureKind::duplicate, Sensor::legs, 4, 8, 0}},
  };
  for (std::size_t i = 0; i < schedules.size(); ++i) {
    const Lived lived = live_through(walk(), schedules[i]);
    ASSERT_GT(lived.states.size(), 1500u) << i;
    for (std::size_t k = 0; k < lived.states.size(); ++k) {
      const Output& o = lived.states[k];
      ASSERT_TRUE(is_finite({o.t, o.x, o.P})) << i;
      ASSERT_TRUE(o.omega.allFinite()) << i;
      if (k > 0) {
        ASSERT_GT(o.t, lived.states[k - 1].t) << i;
      }
    }
    EXPECT_GT(lived.states.back().t, walk().time(9.9)) << i << ": it goes on";
  }
}

TEST(LiveWalk, WithoutAnImuThereIsNoPoseAfterOneThatSaysSo) {
  const Lived lived = live_through(walk(), {{lab::FailureKind::drop, Sensor::imu, 5, 6, 0}});
  std::vector<const Output*> during;
  for (const Output& o : lived.states) {
    if (o.t > walk().time(5.15) && o.t < walk().time(5.95)) during.push_back(&o);
  }
  EXPECT_TRUE(during.empty()) << during.size();
  const auto lost =
      std::ranges::find(lived.states, std::string_view("imu lost"), [](const Output& o) { return std::string_view(text_of(o.cause)); });
  ASSERT_NE(lost, lived.states.end());
  EXPECT_EQ(lost->modality, Modality::coast);
}

TEST(LiveWalk, WhatASinkThrowsEndsInStop) {
  Estimator estimator(walk().settings().robot, walk().settings().estimator, walk().used());
  int calls = 0;
  live::LiveRunner runner(estimator, walk().settings().robot, walk().settings().estimator, walk().used(), {},
                          {[&calls](const Output&) {
                             ++calls;
                             throw std::runtime_error("disk full");
                           },
                           [](const Output&) {}});
  walk().play({}, [&runner](Measurement m) { push_and_wait(runner, std::move(m)); });
  EXPECT_THROW(runner.stop(), std::runtime_error);
  EXPECT_TRUE(runner.failed());
  EXPECT_EQ(calls, 1);
}

}  // namespace walk_test
}  // namespace kilvo
