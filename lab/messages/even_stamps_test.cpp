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
double error_after(EvenSweeps& even, const std::vector<Sweep>& sweeps, std::size_t from) {
  std::vector<double> errors;
  for (std::size_t k = 0; k < sweeps.size(); ++k) {
    const double used = seconds(even.follow(at(sweeps[k].stamp), at(sweeps[k].stamp), at(sweeps[k].stamp + sweeps[k].span)));
    if (k >= from) errors.push_back(used - sweeps[k].truth);
  }
  double mean = 0, square = 0;
  for (const double e : errors) mean += e / static_cast<double>(errors.size());
  for (const double e : errors) square += (e - mean) * (e - mean) / static_cast<double>(errors.size());
  return std::sqrt(square);
}

TEST(EvenStamps, AreFoundBehindStampsThatScatter) {
  for (const double jitter : {3e-4, 1.5e-3, 5e-3}) {
    EvenSweeps even;
    EXPECT_LT(error_after(even, sweeps_of(600, jitter), 100), 0.15 * jitter) << jitter;
    ASSERT_TRUE(even.scatter());
    EXPECT_NEAR(*even.scatter(), jitter, 0.4 * jitter);
  }
}

TEST(EvenStamps, SurviveSweepsThatAreMissing) {
  auto sweeps = sweeps_of(600, 1.5e-3);
  sweeps.erase(sweeps.begin() + 200, sweeps.begin() + 260);
  for (std::size_t k = 300; k < sweeps.size(); k += 5) sweeps.erase(sweeps.begin() + static_cast<std::ptrdiff_t>(k));
  EvenSweeps even;
  EXPECT_LT(error_after(even, sweeps, 100), 3e-4);
}

TEST(EvenStamps, AreThoseOfANewClockAfterItHasBeenSet) {
  for (const double by : {-3600.0, -1.0, -0.03, 0.03, 1.0, 3600.0}) {
    auto sweeps = sweeps_of(600, 1.5e-3);
    for (std::size_t k = 200; k < sweeps.size(); ++k) sweeps[k].truth += by, sweeps[k].stamp += by;
    EvenSweeps even;
    EXPECT_LT(error_after(even, sweeps, 320), 4e-4) << by;
  }
}

TEST(EvenStamps, OneThatIsFarOffIsNotBelieved) {
  auto sweeps = sweeps_of(300, 1e-3);
  for (std::size_t k = 100; k < sweeps.size(); k += 20) sweeps[k].stamp += 0.02;
  EvenSweeps even;
  EXPECT_LT(error_after(even, sweeps, 90), 4e-4);
}

/// To the last nanosecond what it was.
void expect_unchanged(const std::vector<Sweep>& sweeps) {
  EvenSweeps even;
  for (const Sweep& s : sweeps) ASSERT_EQ(even.follow(at(s.stamp), at(s.stamp), at(s.stamp + s.span)), at(s.stamp)) << s.stamp;
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
  EvenSweeps even;
  int changed = 0;
  for (const Sweep& s : sweeps) changed += even.follow(at(s.stamp), at(s.stamp), at(s.stamp + s.span)) == at(s.stamp) ? 0 : 1;
  EXPECT_LT(changed, 30);
}

/// The same for `count` samples of an IMU of 200 Hz whose stamps are `stamp(k, truth)`; `lost` of them are missing.
template <class F>
double error_of_samples(F stamp, int count, int lost = -1) {
  EvenSamples even;
  double mean = 0, squares = 0;
  int n = 0;
  for (int k = 0; k < count; ++k) {
    const double truth = 1000 + 0.005 * k;
    if (lost > 0 && k % lost == lost - 1) continue;
    const double error = seconds(even.follow(at(stamp(k, truth)))) - truth;
    if (k < 500) continue;
    mean += error, squares += error * error, ++n;
  }
  EXPECT_TRUE(even.lateness());
  EXPECT_LT(std::abs(mean / n), 2e-3);
  return std::sqrt(squares / n - mean / n * mean / n);
}

TEST(EvenStamps, OfSamplesThatComeInBursts) {
  for (const int burst : {3, 5, 10, 16}) {
    const auto last_of = [burst](int k) { return 0.005 * (burst - 1 - k % burst); };
    EXPECT_LT(error_of_samples([&](int k, double truth) { return truth + last_of(k); }, 3000), 6e-4) << burst;
    EXPECT_LT(error_of_samples([&](int k, double truth) { return truth + last_of(k) + 2e-5 * (k % burst); }, 3000), 6e-4) << burst;
    for (const int lost : {1001, 101, 21}) {
      EXPECT_LT(error_of_samples([&](int k, double truth) { return truth + last_of(k); }, 6000, lost), 4e-3) << burst << " " << lost;
    }
  }
}

/// To the last nanosecond what they were.
template <class F>
void expect_samples_unchanged(F stamp, int count) {
  EvenSamples even;
  for (int k = 0; k < count; ++k) {
    const Time t = at(stamp(k));
    ASSERT_EQ(even.follow(t), t) << k;
  }
  EXPECT_FALSE(even.lateness());
}

TEST(EvenStamps, SamplesThatComeOneByOneAreKept) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise;
  std::exponential_distribution<double> delay(1 / 0.0015);
  expect_samples_unchanged([&](int k) { return 1000 + 0.005 * k + 5e-4 * noise(random); }, 2000);
  double last = 0;
  expect_samples_unchanged([&](int k) { return last = std::max(last + 2e-5, 1000 + 0.005 * k + delay(random)); }, 4000);
  // The computer is busy for 60 ms now and then, and twelve samples wait.
  expect_samples_unchanged([](int k) { return 1000 + 0.005 * (k % 80 < 12 ? k - k % 80 + 12 : k); }, 4000);
}

TEST(EvenStamps, SamplesOfWhichManyAreLostAreKept) {
  for (const double lost : {0.01, 0.2, 0.5, 0.6, 0.7}) {
    for (const double period : {0.001, 0.005, 0.02}) {
      std::mt19937 random(6);
      std::bernoulli_distribution is_lost(lost);
      double t = 1000;
      expect_samples_unchanged(
          [&](int) {
            do t += period;
            while (is_lost(random));
            return t;
          },
          4000);
    }
  }
}

TEST(EvenStamps, SamplesThatOvertakeEachOtherAreKept) {
  std::mt19937 random(5);
  std::vector<double> stamps;
  for (int k = 0; k < 3000; ++k) stamps.push_back(1000 + 0.005 * k);
  for (std::size_t k = 0; k + 1 < stamps.size(); ++k) {
    if (random() % 5 == 0) std::swap(stamps[k], stamps[k + 1]);
  }
  expect_samples_unchanged([&](int k) { return stamps[static_cast<std::size_t>(k)]; }, 3000);
}

TEST(EvenStamps, OfSamplesNeverGoBackNorAheadOfWhatCame) {
  std::mt19937 random(7);
  EvenSamples even;
  Time last{};
  for (int k = 0; k < 5000; ++k) {
    if (random() % 50 == 0 || (k > 2000 && k < 2040)) continue;  // lost
    const Time stamp = at(1000 + 0.005 * (k / 5 * 5 + 4) + (k > 3000 ? 0.3 : 0));
    const Time used = even.follow(stamp);
    EXPECT_LE(used, stamp);
    EXPECT_GE(used, last);
    last = used;
  }
}

TEST(EvenStamps, OfSamplesGoOnAfterTheClockHasBeenSet) {
  for (const double by : {-3600.0, -1.0, -0.03, 0.03, 1.0, 3600.0}) {
    EvenSamples even;
    double worst = 0;
    for (int k = 0; k < 4000; ++k) {
      const double offset = k > 2000 ? by : 0;
      const double used = seconds(even.follow(at(1e5 + offset + 0.005 * (k / 5 * 5 + 4))));
      if (k > 1000 && (k < 2000 || k > 2200)) worst = std::max(worst, std::abs(used - (1e5 + offset + 0.005 * k)));
    }
    EXPECT_LT(worst, 2e-3) << by;
  }
}

TEST(EvenStamps, TwoSensorsThatTakeTurnsAreKept) {
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 600; ++k) sweeps.push_back({0, 1000 + 0.05 * k + (k % 2 == 0 ? 0 : 0.008), 0.1});
  expect_unchanged(sweeps);
}

TEST(EvenStamps, SweepsThatShareAPacketAreKept) {
  std::mt19937 random(8);
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 600; ++k)
    sweeps.push_back({0, 1000 + 1.327e-3 * std::floor((period * k + 1e-3 * static_cast<double>(random() % 3)) / 1.327e-3), 0});
  for (std::size_t k = 0; k + 1 < sweeps.size(); ++k) sweeps[k].span = sweeps[k + 1].stamp - sweeps[k].stamp + 1.327e-3;
  sweeps.pop_back();
  expect_unchanged(sweeps);
}

TEST(EvenStamps, LateAndRepeatedMessagesAreReturnedAsTheyCame) {
  EvenSweeps even;
  const auto sweeps = sweeps_of(200, 1.5e-3);
  error_after(even, sweeps, 100);
  for (const std::size_t k : {199U, 150U})
    EXPECT_EQ(even.follow(at(sweeps[k].stamp), at(sweeps[k].stamp), at(sweeps[k].stamp + period)), at(sweeps[k].stamp));
}

}  // namespace even_stamps_test
}  // namespace kilvo::lab
