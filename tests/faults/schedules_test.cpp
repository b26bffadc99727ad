// Random failures of any sensors at any times, one upon another. KILVO_SCHEDULES=300 kilvo_faults_test --gtest_filter=Schedules.*
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>

#include "tests/faults/failing_walk.hpp"

namespace kilvo {
namespace schedules_test {

using lab::Failure;
using lab::FailureKind;

constexpr double seconds = 14;

// The draws are written out so that they are the same with every standard library.
double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) / 9007199254740992.0;
}

std::vector<Failure> schedule(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  constexpr FailureKind kinds[] = {FailureKind::drop, FailureKind::freeze, FailureKind::not_a_number, FailureKind::delay};
  std::vector<Failure> out(1 + random() % 4);
  for (Failure& f : out) {
    f.kind = kinds[random() % 4];
    f.sensor = static_cast<Sensor>(random() % 4);
    if (f.sensor == Sensor::camera && f.kind == FailureKind::not_a_number) f.kind = FailureKind::darkness;
    f.from = uniform(random, 2.5, seconds - 4);
    f.until = std::min(seconds - 2, f.from + uniform(random, 0.02, f.sensor == Sensor::imu ? 1.5 : 3));
    if (f.kind == FailureKind::delay) f.amount = uniform(random, 0.01, 0.5);
  }
  return out;
}

std::string words(const std::vector<Failure>& failures) {
  constexpr const char* kinds[] = {"drop", "freeze", "delay", "not_a_number"};  // as in FailureKind
  std::string out;
  for (const Failure& f : failures) {
    char text[100];
    std::snprintf(text, sizeof text, " %s %s %.2f-%.2f (%.2f)",
                  f.kind == FailureKind::darkness ? "darkness" : kinds[static_cast<int>(f.kind)], name_of(f.sensor), f.from, f.until,
                  f.amount);
    out += text;
  }
  return out;
}

TEST(Schedules, OfRandomFailuresAreOutlived) {
  const char* text = std::getenv("KILVO_SCHEDULES");
  const int count = text != nullptr ? std::atoi(text) : 17;
  const char* first_text = std::getenv("KILVO_FIRST_SCHEDULE");
  const int first = first_text != nullptr ? std::atoi(first_text) : 1;
  const test::FailingWalk walk("room", 3, seconds, true);
  int bad = 0;
  for (int n = first; n < first + count; ++n) {
    const std::vector<Failure> failures = schedule(static_cast<std::uint64_t>(n));
    const test::Outcome o = walk.with(failures);
    EXPECT_TRUE(o.finite && o.ordered) << n << words(failures);
    ASSERT_FALSE(o.moments.empty());
    const test::Moment& last = o.moments.back();
    // Of every output, position and attitude: where the estimate is wrong it says so. One in a thousand is a matter of luck.
    const auto lies = std::ranges::count_if(o.moments, [](const test::Moment& m) { return m.s > 1 && m.sigmas > 6; });
    const auto tilted = std::ranges::count_if(o.moments, [](const test::Moment& m) { return m.s > 1 && m.tilt_sigmas > 6; });
    const bool good = last.error < 0.5 && last.sigmas < 4 && last.tilt_sigmas < 4 && 1000 * lies < std::ssize(o.moments) &&
                      1000 * tilted < std::ssize(o.moments);
    bad += good ? 0 : 1;
    EXPECT_TRUE(good) << "schedule " << n << ": " << last.error << " m, " << last.sigmas << " sigmas and " << last.tilt_sigmas
                      << " of attitude at the end, " << lies << " and " << tilted << " of " << o.moments.size()
                      << " outputs beyond six sigmas (" << o.worst(&test::Moment::sigmas, 1, seconds) << " at "
                      << o.when_worst(&test::Moment::sigmas, 1, seconds) << " s, " << o.worst(&test::Moment::tilt_sigmas, 1, seconds)
                      << " at " << o.when_worst(&test::Moment::tilt_sigmas, 1, seconds) << " s):" << words(failures);
  }
  std::printf("%d of %d schedules good\n", count - bad, count);
}

}  // namespace schedules_test
}  // namespace kilvo
