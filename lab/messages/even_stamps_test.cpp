#include "lab/messages/even_stamps.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace kilvo::lab {
namespace even_stamps_test {

constexpr double period = 0.1;

struct Sweep {
  double truth, stamp, span = period;  // s
};

/// `count` sweeps of a LiDAR that never pauses, 20 ppm fast, with stamps that scatter by `jitter`.
std::vector<Sweep> sweeps_of(int count, double jitter, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  std::vector<Sweep> out;
  for (int k = 0; k < count; ++k) {
    const double t = 1000 + (period - 2e-6) * k;
    out.push_back({t, t + jitter * noise(random)});
  }
  return out;
}

Time at(double seconds) { return Time{} + from_seconds(seconds); }
double seconds(Time t) { return to_seconds(t.time_since_epoch()); }

/// What is left of the error of each stamp, its mean excepted from sweep `from` on: root mean square, s.
double error_after(EvenStamps& even, const std::vector<Sweep>& sweeps, std::size_t from) {
  std::vector<double> errors;
  for (std::size_t k = 0; k < sweeps.size(); ++k) {
    const double used = seconds(even.follow_sweep(at(sweeps[k].stamp), at(sweeps[k].stamp), at(sweeps[k].stamp + sweeps[k].span)));
    if (k >= from) errors.push_back(used - sweeps[k].truth);
  }
  double mean = 0, square = 0;
  for (const double e : errors) mean += e / static_cast<double>(errors.size());
  for (const double e : errors) square += (e - mean) * (e - mean) / static_cast<double>(errors.size());
  return std::sqrt(square);
}

TEST(EvenStamps, AreFoundBehindStampsThatScatter) {
  for (const double jitter : {3e-4, 1.5e-3, 5e-3}) {
    EvenStamps even;
    EXPECT_LT(error_after(even, sweeps_of(600, jitter), 100), 0.15 * jitter) << jitter;
    ASSERT_TRUE(even.scatter());
    EXPECT_NEAR(*even.scatter(), jitter, 0.4 * jitter);
  }
}

TEST(EvenStamps, SurviveSweepsThatAreMissing) {
  auto sweeps = sweeps_of(600, 1.5e-3);
  sweeps.erase(sweeps.begin() + 200, sweeps.begin() + 260);
  for (std::size_t k = 300; k < sweeps.size(); k += 5) sweeps.erase(sweeps.begin() + static_cast<std::ptrdiff_t>(k));
  EvenStamps even;
  EXPECT_LT(error_after(even, sweeps, 100), 3e-4);
}

TEST(EvenStamps, AreThoseOfANewClockAfterItHasBeenSet) {
  auto sweeps = sweeps_of(600, 1.5e-3);
  for (std::size_t k = 200; k < sweeps.size(); ++k) sweeps[k].truth += 0.03, sweeps[k].stamp += 0.03;
  EvenStamps even;
  EXPECT_LT(error_after(even, sweeps, 300), 3e-4);
}

TEST(EvenStamps, OneThatIsFarOffIsNotBelieved) {
  auto sweeps = sweeps_of(300, 1e-3);
  for (std::size_t k = 100; k < sweeps.size(); k += 20) sweeps[k].stamp += 0.02;
  EvenStamps even;
  EXPECT_LT(error_after(even, sweeps, 90), 4e-4);
}

/// To the last nanosecond what it was.
void expect_unchanged(const std::vector<Sweep>& sweeps) {
  EvenStamps even;
  for (const Sweep& s : sweeps) ASSERT_EQ(even.follow_sweep(at(s.stamp), at(s.stamp), at(s.stamp + s.span)), at(s.stamp)) << s.stamp;
  EXPECT_FALSE(even.scatter());
}

TEST(EvenStamps, StampsThatAreEvenAreKept) { expect_unchanged(sweeps_of(300, 2e-5)); }

TEST(EvenStamps, StampsOfSweepsThatEndBeforeTheNextBeginsAreKept) {
  // It may be the sensor itself that begins sooner or later.
  auto sweeps = sweeps_of(300, 1.5e-3);
  for (Sweep& s : sweeps) s.span = 0.9 * period;
  expect_unchanged(sweeps);
}

TEST(EvenStamps, StampsOfSweepsThatAreCutSoonerOrLaterAreKept) {
  auto sweeps = sweeps_of(300, 1.5e-3);
  for (std::size_t k = 0; k + 1 < sweeps.size(); ++k) sweeps[k].span = sweeps[k + 1].stamp - sweeps[k].stamp - 1e-5;
  expect_unchanged(sweeps);
}

TEST(EvenStamps, StampsOfASensorThatWalksAreKept) {
  // Each step has a length of its own, and the sweeps are described as too long: no line explains that.
  std::mt19937 random(2);
  std::normal_distribution<double> noise;
  std::vector<Sweep> sweeps;
  for (double t = 1000; t < 1060; t += period + 2e-3 * noise(random)) sweeps.push_back({t, t});
  EvenStamps even;
  int changed = 0;
  for (const Sweep& s : sweeps) changed += even.follow_sweep(at(s.stamp), at(s.stamp), at(s.stamp + s.span)) == at(s.stamp) ? 0 : 1;
  EXPECT_LT(changed, 30);
}

/// The same for `count` samples of an IMU of 200 Hz whose stamps are `stamp(k, truth)`; `lost` of them are missing.
template <class F>
double error_of_samples(F stamp, int count, int lost = -1) {
  EvenStamps even;
  double mean = 0, squares = 0;
  int n = 0;
  for (int k = 0; k < count; ++k) {
    const double truth = 1000 + 0.005 * k;
    if (lost > 0 && k % lost == lost - 1) continue;
    const double error = seconds(even.follow_sample(at(stamp(k, truth)))) - truth;
    if (k < 500) continue;
    mean += error, squares += error * error, ++n;
  }
  EXPECT_TRUE(even.scatter());
  EXPECT_LT(std::abs(mean / n), 3.5e-3);
  return std::sqrt(squares / n - mean / n * mean / n);
}

TEST(EvenStamps, OfSamplesThatComeInBursts) {
  for (const int burst : {3, 5, 10, 16}) {
    const auto last_of = [burst](int k) { return 0.005 * (burst - 1 - k % burst); };
    EXPECT_LT(error_of_samples([&](int k, double truth) { return truth + last_of(k); }, 3000), 6e-4) << burst;
    EXPECT_LT(error_of_samples([&](int k, double truth) { return truth + last_of(k) + 2e-5 * (k % burst); }, 3000), 6e-4) << burst;
    EXPECT_LT(error_of_samples([&](int k, double truth) { return truth + last_of(k); }, 6000, 1001), 2e-3) << burst;
  }
}

TEST(EvenStamps, OfSamplesWhoseStampsScatterByHalfAPeriod) {
  std::mt19937 random(3);
  std::exponential_distribution<double> delay(1 / 0.003);
  double last = 0;
  const auto stamp = [&](int, double truth) { return last = std::max(last + 2e-5, truth + delay(random)); };
  EXPECT_LT(error_of_samples(stamp, 3000), 5e-4);
}

TEST(EvenStamps, SamplesThatAreEvenButForALittleAreKept) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise;
  EvenStamps even;
  for (int k = 0; k < 2000; ++k) {
    const Time stamp = at(1000 + 0.005 * k + 5e-4 * noise(random));
    ASSERT_EQ(even.follow_sample(stamp), stamp);
  }
}

TEST(EvenStamps, OfMessagesThatOvertakeEachOtherAreKept) {
  std::mt19937 random(5);
  std::vector<double> stamps;
  for (int k = 0; k < 3000; ++k) stamps.push_back(1000 + 0.005 * k);
  for (std::size_t k = 0; k + 1 < stamps.size(); ++k) {
    if (random() % 5 == 0) std::swap(stamps[k], stamps[k + 1]);
  }
  EvenStamps even;
  for (const double t : stamps) ASSERT_EQ(even.follow_sample(at(t)), at(t));
}

TEST(EvenStamps, LateAndRepeatedMessagesAreReturnedAsTheyCame) {
  EvenStamps even;
  const auto sweeps = sweeps_of(200, 1.5e-3);
  error_after(even, sweeps, 100);
  for (const std::size_t k : {199U, 150U})
    EXPECT_EQ(even.follow_sweep(at(sweeps[k].stamp), at(sweeps[k].stamp), at(sweeps[k].stamp + period)), at(sweeps[k].stamp));
}

}  // namespace even_stamps_test
}  // namespace kilvo::lab
