#include "lab/contacts/clearance_window.hpp"

#include <gtest/gtest.h>

namespace kilvo::lab {
namespace clearance_window_test {

using std::chrono::milliseconds;

constexpr double rise = 0.05, lasts = 0.3;  // m, s

ClearanceWindow filled(double (*clearance)(double u), int samples = 301) {
  ClearanceWindow out;
  for (int i = 0; i < samples; ++i) {
    const double u = static_cast<double>(i) / (samples - 1);
    out.add(time_from_ns(0) + from_seconds(u * lasts), clearance(u));
  }
  return out;
}

TEST(ClearanceWindow, ASwingEnclosesItsAreaWithTheChord) {
  const auto window = filled([](double u) { return 4 * rise * u * (1 - u); });
  EXPECT_NEAR(window.area(milliseconds(300)).value(), 2.0 / 3 * rise * lasts, 1e-6);
}

TEST(ClearanceWindow, AnEvenCourseEnclosesNoneWhereverItLies) {
  const auto window = filled([](double u) { return 0.7 - rise * u; });
  EXPECT_NEAR(window.area(milliseconds(300)).value(), 0, 1e-12);
  EXPECT_NEAR(window.trend(milliseconds(300)).value(), -rise / lasts, 1e-9);
}

TEST(ClearanceWindow, TheTrendIsThatOfTheSliceAlone) {
  const auto window = filled([](double u) { return u < 0.5 ? 2 * rise * u : 2 * rise * (1 - u); });
  EXPECT_NEAR(window.trend(milliseconds(100)).value(), -2 * rise / lasts, 1e-9);
  EXPECT_NEAR(window.trend(milliseconds(300)).value(), 0, 1e-9);
}

TEST(ClearanceWindow, TheSameAtEveryRate) {
  const auto course = [](double u) { return 4 * rise * u * (1 - u); };
  for (const int samples : {16, 31, 151, 601}) {
    EXPECT_NEAR(filled(course, samples).area(milliseconds(300)).value(), 2.0 / 3 * rise * lasts, 0.01 * rise * lasts) << samples;
  }
}

TEST(ClearanceWindow, FewClearancesSayNothing) {
  ClearanceWindow window;
  for (int i = 0; i < 2; ++i) window.add(time_from_ns(0) + milliseconds(i), 0.1 * i);
  EXPECT_FALSE(window.area(milliseconds(300)));
  EXPECT_FALSE(window.trend(milliseconds(300)));
}

TEST(ClearanceWindow, TheOldestGoFirst) {
  ClearanceWindow window;
  for (int i = 0; i < 5000; ++i) window.add(time_from_ns(0) + milliseconds(i), i < 4500 ? 1.0 : 1.0 + 1e-3 * (i - 4500));
  EXPECT_NEAR(window.trend(milliseconds(400)).value(), 1.0, 1e-9);
}

}  // namespace clearance_window_test
}  // namespace kilvo::lab
