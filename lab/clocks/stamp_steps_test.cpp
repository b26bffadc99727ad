#include "lab/clocks/stamp_steps.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace kilvo::lab {
namespace stamp_steps_test {

const Time day = time_from_ns(1'700'000'000'000'000'000);

double none(double) { return 0; }

/// Ten seconds of legs at 500 Hz, each message 1 ms and a random part of a millisecond on its way.
struct Stream {
  std::function<double(double)> legs_ahead = none;  // s, of the clock at a time
  std::function<double(double)> waits = none;       // s, of the legs' message of a time
  std::function<bool(double)> is_lost = [](double) { return false; };

  struct Message {
    double t = 0, arrived = 0;
  };
  std::vector<Message> messages() const {
    std::mt19937_64 random(1);
    std::exponential_distribution<double> way(1e3);
    std::vector<Message> out;
    for (int k = 0; k < 5000; ++k) {
      const double t = 0.002 * k;
      if (!is_lost(t)) out.push_back({t, t + 1e-3 + way(random) + waits(t)});
    }
    std::ranges::stable_sort(out, {}, &Message::arrived);
    return out;
  }
  StampSteps after() const {
    StampSteps steps;
    for (const Message& m : messages()) steps.note(day + from_seconds(m.t + legs_ahead(m.t)), day + from_seconds(m.arrived));
    return steps;
  }
};

std::function<double(double)> by(double step) {
  return [step](double t) { return t > 5 ? step : 0; };
}

TEST(StampSteps, OfTheClockAreMadeGood) {
  for (const double step : {0.15, -0.15, 0.03, -0.03, 3600.0, -3600.0}) {
    const StampSteps steps = Stream{.legs_ahead = by(step)}.after();
    EXPECT_EQ(steps.count(), 1) << step;
    EXPECT_NEAR(to_seconds(steps.correction()), -step, 1e-3) << step;
  }
  const StampSteps two = Stream{.legs_ahead = [](double t) { return t > 7 ? -0.05 : t > 3 ? 0.2 : 0; }}.after();
  EXPECT_EQ(two.count(), 2);
  EXPECT_NEAR(to_seconds(two.correction()), 0.05, 1e-3);
}

TEST(StampSteps, AreNoneOfMessagesThatWaitAreLostOrHaveOneWrongStamp) {
  const auto stalls = [](double t) { return t > 5 && t < 6 ? 6 - t : 0; };
  EXPECT_EQ((Stream{.waits = stalls}.after().count()), 0);
  EXPECT_EQ((Stream{.waits = stalls, .is_lost = [](double t) { return t > 5.3 && t < 5.8; }}.after().count()), 0);
  EXPECT_EQ((Stream{.is_lost = [](double t) { return t > 5 && t < 7; }}.after().count()), 0);
  EXPECT_EQ((Stream{.waits = by(0.1)}.after().count()), 0) << "a slower way from then on";
  for (const double wrong : {0.5, -0.5})
    EXPECT_EQ((Stream{.legs_ahead = [=](double t) { return t > 5 && t < 5.003 ? wrong : 0; }}.after().count()), 0);
  const auto bursts = [](double t) { return 0.1 - std::fmod(t, 0.1); };
  EXPECT_EQ((Stream{.waits = bursts}.after().count()), 0);
  EXPECT_EQ((Stream{.legs_ahead = by(0.3), .waits = bursts}.after().count()), 1);
}

// What waited for a second is dropped: stamps jump ahead by a second, and come as late as they once did.
TEST(StampSteps, AreNoneOfABacklogThatIsDropped) {
  const auto backlog = [](double t) { return std::clamp(0.5 * (t - 2), 0.0, 1.0) * (t < 5 ? 1 : 0); };
  EXPECT_EQ((Stream{.waits = backlog, .is_lost = [](double t) { return t > 4 && t < 5; }}.after().count()), 0);
}

// What waits in the first second and is dropped then: sooner than ever is little after a second.
TEST(StampSteps, AreNoneOfABusyStart) {
  const auto busy = [](double t) { return t < 1 ? 0.3 : 0; };
  EXPECT_EQ((Stream{.waits = busy, .is_lost = [](double t) { return t > 0.7 && t < 1; }}.after().count()), 0);
}

}  // namespace stamp_steps_test
}  // namespace kilvo::lab
