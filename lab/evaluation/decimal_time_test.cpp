#include "lab/evaluation/decimal_time.hpp"

#include <cstdio>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace kilvo::lab {
namespace decimal_time_test {

std::int64_t ns(std::string_view text) {
  const auto t = parse_seconds(text);
  EXPECT_TRUE(t) << text;
  return t ? to_ns(*t) : -1;
}

std::string printed(std::int64_t n) {
  std::string text;
  append_seconds(text, time_from_ns(n));
  return text;
}

std::string fixed9(double x) {
  std::string text;
  append_fixed9(text, x);
  return text;
}

TEST(DecimalTime, KeepsEveryNanosecondOfATimeOfToday) {
  EXPECT_EQ(ns("1700010000.123456789"), 1700010000123456789);
  EXPECT_EQ(ns("1700010000.000000001"), 1700010000000000001);
  EXPECT_EQ(printed(1700010000123456789), "1700010000.123456789");
}

TEST(DecimalTime, ReadsWhatOtherProgramsWrite) {
  EXPECT_EQ(ns("1.700010000123456789e+09"), 1700010000123456789);
  EXPECT_EQ(ns("1.700010000123456717e+09"), 1700010000123456717);  // numpy: a double's digits
  EXPECT_EQ(ns("0"), 0);
  EXPECT_EQ(ns("12"), 12000000000);
  EXPECT_EQ(ns("12."), 12000000000);
  EXPECT_EQ(ns(".5"), 500000000);
  EXPECT_EQ(ns("+1.25"), 1250000000);
  EXPECT_EQ(ns("-0.5"), -500000000);
  EXPECT_EQ(ns("5e-9"), 5);
  EXPECT_EQ(ns("0.0000000000e+00"), 0);
  EXPECT_EQ(ns("12300E-2"), 123000000000);
  EXPECT_EQ(ns("0e100"), 0);
}

TEST(DecimalTime, RoundsBelowANanosecondToTheNearest) {
  EXPECT_EQ(ns("1700010000.1234567894999"), 1700010000123456789);
  EXPECT_EQ(ns("1700010000.1234567895"), 1700010000123456790);
  EXPECT_EQ(ns("-0.0000000006"), -1);
  EXPECT_EQ(ns("4e-10"), 0);
  EXPECT_EQ(ns("123456789012345678901234567890e-2147483647"), 0);
}

TEST(DecimalTime, RefusesWhatIsNotANumberOrDoesNotFit) {
  for (const char* text : {"", ".", "-", "e5", "1e", "1e+", "1e+-2", "nan", "inf", "1.2.3", "1,5", "0x10", "12s", " 1", "1 ", "9223372037",
                           "1e10", "1e999", "1e99999999999"}) {
    EXPECT_FALSE(parse_seconds(text)) << text;
  }
  EXPECT_EQ(ns("9223372036.854775807"), 9223372036854775807);
}

TEST(DecimalTime, PrintsAndParsesBackAnyNanosecond) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 10000; ++i) {
    const auto n = static_cast<std::int64_t>(random()) >> (random() % 63);
    if (n == std::numeric_limits<std::int64_t>::min()) continue;
    ASSERT_EQ(ns(printed(n)), n);
  }
  EXPECT_EQ(printed(-1), "-0.000000001");
  EXPECT_EQ(printed(-1500000000), "-1.500000000");
  EXPECT_EQ(printed(std::numeric_limits<std::int64_t>::min()), "-9223372036.854775808");
}

TEST(DecimalTime, FixedNumbersAreThoseOfPrintfWithoutNegativeZero) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> metres(-1000, 1000);
  for (int i = 0; i < 10000; ++i) {
    const double x = metres(random);
    char expected[64];
    std::snprintf(expected, sizeof(expected), "%.9f", x);
    // The product with 1e9 rounds once more, so a last digit may differ where the tenth is a five.
    ASSERT_NEAR(std::stod(fixed9(x)), std::stod(expected), 1.001e-9);
    ASSERT_EQ(fixed9(x).size(), std::string(expected).size());
  }
  EXPECT_EQ(fixed9(-1e-12), "0.000000000");
  EXPECT_EQ(fixed9(-0.25), "-0.250000000");
  EXPECT_EQ(fixed9(1e10), "10000000000.000000000");
  EXPECT_EQ(fixed9(std::numeric_limits<double>::quiet_NaN()).find("nan"), fixed9(std::numeric_limits<double>::quiet_NaN()).size() - 3);
}

TEST(AppendFixed, WritesWhatPrintfWrites) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> size(-9, 9), sign(-1, 1);
  const auto expect_same = [](double x, int decimals) {
    char expected[400];
    std::snprintf(expected, sizeof expected, "%.*f", decimals, x);
    std::string text;
    append_fixed(text, x, decimals);
    EXPECT_EQ(text, expected);
  };
  for (int i = 0; i < 20000; ++i) expect_same(sign(random) * std::pow(10, size(random)), 1 + i % 5);
  for (const double x : {0.0, -0.0, -1e-7, 0.0625, 0.1875, 2.5, 1e10, -1e300}) expect_same(x, 3);
}

}  // namespace decimal_time_test
}  // namespace kilvo::lab
