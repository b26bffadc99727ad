#include "lab/messages/point_time.hpp"

#include <gtest/gtest.h>

#include "lab/messages/livox.hpp"
#include "lab/messages/point_cloud2.hpp"
#include "lab/messages/tiny_cloud.hpp"

namespace kilvo::lab {
namespace point_time_test {

constexpr Duration period = std::chrono::milliseconds(100);
constexpr std::uint32_t points = 200;

/// Seconds from the scan's start to point i: unsorted, 0 to 0.0995 s.
double since_start(std::size_t i) { return 0.0005 * static_cast<double>((i * 37) % points); }

/// Three scans of a driver that writes `value(stamp, seconds since the start)` of type T.
template <class T, class Value>
std::vector<std::vector<std::uint8_t>> scans(const std::string& field, ScalarType type, Value value) {
  std::vector<std::vector<std::uint8_t>> messages;
  for (int k = 0; k < 3; ++k) {
    auto cloud = TinyCloud::line(points);
    cloud.stamp += k * period;
    const std::int64_t stamp = to_ns(cloud.stamp);
    cloud.with_times<T>(field, type, [&](std::size_t i) { return value(stamp, since_start(i)); });
    messages.push_back(cloud.bytes());
  }
  return messages;
}

Decoded<PointTimeFormat> detect(const std::vector<std::vector<std::uint8_t>>& messages) {
  std::vector<CloudTimes> clouds;
  for (const auto& message : messages) {
    auto times = observe_point_cloud2(message);
    EXPECT_TRUE(times) << times.reason();
    if (times) clouds.push_back(*std::move(times));
  }
  return detect_point_time(clouds, period);
}

/// Largest error of the decoded offsets, ns; `end` when the stamp is the scan's end.
double worst_offset(const std::vector<std::uint8_t>& message, const PointTimeFormat& format, double stamp_after_start = 0) {
  const auto decoded = decode_point_cloud2(message, format);
  EXPECT_TRUE(decoded) << decoded.reason();
  EXPECT_EQ(decoded->scan.points.size(), points);
  EXPECT_EQ(decoded->absurd_times, 0U);
  double worst = 0;
  for (std::size_t i = 0; i < decoded->scan.points.size(); ++i) {
    worst = std::max(worst, std::abs(decoded->scan.points[i].offset_ns - 1e9 * (since_start(i) - stamp_after_start)));
  }
  return worst;
}

TEST(PointTime, LivoxPointCloud2IsAbsoluteNanosecondsInADouble) {
  const auto messages =
      scans<double>("timestamp", ScalarType::float64, [](std::int64_t stamp, double s) { return static_cast<double>(stamp) + 1e9 * s; });
  const auto format = detect(messages);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "timestamp (float64): nanoseconds, absolute");
  EXPECT_LE(worst_offset(messages[1], *format), 256);
}

TEST(PointTime, VelodyneCountsSecondsFromTheStartInAFloat) {
  const auto messages = scans<float>("time", ScalarType::float32, [](std::int64_t, double s) { return s; });
  const auto format = detect(messages);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "time (float32): seconds, from the scan's start");
  EXPECT_LE(worst_offset(messages[1], *format), 10);
}

TEST(PointTime, OlderVelodyneDriversCountSecondsBeforeTheEnd) {
  const auto messages = scans<float>("time", ScalarType::float32, [](std::int64_t, double s) { return s - 0.0995; });
  const auto format = detect(messages);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "time (float32): seconds, before the scan's end");
  EXPECT_LE(worst_offset(messages[1], *format, 0.0995), 10);
}

TEST(PointTime, OusterCountsNanosecondsFromTheStartInAnInteger) {
  const auto messages = scans<std::uint32_t>("t", ScalarType::uint32, [](std::int64_t, double s) { return 1e9 * s; });
  const auto format = detect(messages);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "t (uint32): nanoseconds, from the scan's start");
  EXPECT_LE(worst_offset(messages[1], *format), 1);
}

TEST(PointTime, HesaiAndRobosenseGiveAbsoluteSecondsInADouble) {
  const auto messages =
      scans<double>("timestamp", ScalarType::float64, [](std::int64_t stamp, double s) { return 1e-9 * static_cast<double>(stamp) + s; });
  const auto format = detect(messages);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "timestamp (float64): seconds, absolute");
  EXPECT_LE(worst_offset(messages[1], *format), 500);
}

TEST(PointTime, MillisecondsAndMicrosecondsAreToldBySpan) {
  const auto milli = detect(scans<float>("offset_time", ScalarType::float32, [](std::int64_t, double s) { return 1e3 * s; }));
  ASSERT_TRUE(milli) << milli.reason();
  EXPECT_EQ(milli->text(), "offset_time (float32): milliseconds, from the scan's start");
  const auto micro = detect(scans<std::int32_t>("stamps", ScalarType::int32, [](std::int64_t, double s) { return 1e6 * s; }));
  ASSERT_TRUE(micro) << micro.reason();
  EXPECT_EQ(micro->text(), "stamps (int32): microseconds, from the scan's start");
}

TEST(PointTime, A64BitIntegerMayComeAsTwoHalves) {
  const auto messages = scans<std::uint64_t>("time_stamp", ScalarType::uint64,
                                             [](std::int64_t stamp, double s) { return stamp + static_cast<std::int64_t>(1e9 * s); });
  const auto format = detect(messages);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "time_stamp (uint64): nanoseconds, absolute");
  EXPECT_LE(worst_offset(messages[1], *format), 256);
}

TEST(PointTime, AClockThatIsNotTheStampsCountsFromTheEarliestPoint) {
  // Seconds since the sensor was switched on, while the stamps are of the year 2023.
  const auto messages = scans<double>("timestamp", ScalarType::float64, [](std::int64_t stamp, double s) {
    return 1e-9 * static_cast<double>(stamp % 1'000'000'000'000) + 777 + s;
  });
  const auto format = detect(messages);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "timestamp (float64): seconds, on a clock of its own");
  EXPECT_LE(worst_offset(messages[1], *format), 1);
}

TEST(PointTime, ALonePointWithTimeZeroDoesNotBecomeTheOriginOfSuchAClock) {
  auto cloud = TinyCloud::line(points);
  cloud.with_times<double>("timestamp", ScalarType::float64, [](std::size_t i) { return 777 + since_start(i); });
  cloud.set(5, 16, 0.0);
  const auto format = detect({cloud.bytes()});
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->reference, TimeReference::other_clock);
  const auto decoded = decode_point_cloud2(cloud.bytes(), *format);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->absurd_times, 1U);
  EXPECT_EQ(decoded->scan.points.size(), points - 1);
}

TEST(PointTime, OnAYoungClockRelativeTimesAreNotTakenForAbsolute) {
  const auto young = [](bool absolute) {
    std::vector<CloudTimes> clouds;
    for (int k = 0; k < 3; ++k) {
      auto cloud = TinyCloud::line(points);
      cloud.stamp = time_from_ns(200'000'000) + k * period;
      const double start = absolute ? to_seconds(cloud.stamp.time_since_epoch()) : 0;
      cloud.with_times<double>("timestamp", ScalarType::float64, [&](std::size_t i) { return start + since_start(i); });
      clouds.push_back(*observe_point_cloud2(cloud.bytes()));
    }
    return detect_point_time(clouds, period);
  };
  EXPECT_EQ(young(false)->reference, TimeReference::scan_start);
  EXPECT_EQ(young(true)->reference, TimeReference::absolute);
}

TEST(PointTime, TheFieldThatMakesSenseWinsOverOneThatDoesNot) {
  auto messages = scans<float>("time", ScalarType::float32, [](std::int64_t, double s) { return s; });
  std::vector<CloudTimes> clouds;
  clouds.reserve(messages.size());
  for (const auto& message : messages) clouds.push_back(*observe_point_cloud2(message));
  for (auto& cloud : clouds) cloud.candidates.insert(cloud.candidates.begin(), FieldTimes{"timestamp", "float64", 5, 5, 5});
  const auto format = detect_point_time(clouds, period);
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->field, "time");
}

TEST(PointTime, AnUnusuallyShortScanIsTakenWithAWarning) {
  const auto format = detect(scans<double>("t", ScalarType::float64, [](std::int64_t, double s) { return 0.1 * s; }));
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->unit, TimeUnit::seconds);
  EXPECT_FALSE(format->usual_span);
}

TEST(PointTime, ASpanThatFitsNoUnitIsAnError) {
  const auto format = detect(scans<double>("t", ScalarType::float64, [](std::int64_t, double s) { return 1e-7 * s; }));
  ASSERT_FALSE(format);
  EXPECT_EQ(format.reason(), "the point times in field t (float64) fit no unit: they span 9.6e-09 within a cloud, scans every 0.1 s");
}

TEST(PointTime, AbsentTimesAreAnErrorThatListsTheFields) {
  const auto format = detect({TinyCloud::line(points).bytes()});
  ASSERT_FALSE(format);
  EXPECT_EQ(format.reason(), "the clouds have no point times (fields: x y z intensity)");
}

TEST(PointTime, EqualTimesAreAnErrorThatNamesTheField) {
  const auto format = detect(scans<float>("time", ScalarType::float32, [](std::int64_t, double) { return 0; }));
  ASSERT_FALSE(format);
  EXPECT_EQ(format.reason(), "the point times are all equal (field time; fields: x y z intensity time)");
}

TEST(PointTime, InvalidPointsAndAbsurdTimesDoNotMislead) {
  // An organised cloud: two thirds of the points were not seen, their coordinates are NaN or zero, and their time is 0.
  auto cloud = TinyCloud::line(points);
  const auto stamp = static_cast<double>(to_ns(cloud.stamp));
  cloud.with_times<double>("timestamp", ScalarType::float64, [&](std::size_t i) { return i % 3 == 0 ? stamp + 1e9 * since_start(i) : 0; });
  for (std::size_t i = 0; i < points; ++i) {
    if (i % 3 == 1) cloud.set_point(i, NAN, NAN, NAN, 0);
    if (i % 3 == 2) cloud.set_point(i, 0, 0, 0, 0);
  }
  cloud.set(0, 16, 1e300);
  const auto format = detect({cloud.bytes()});
  ASSERT_TRUE(format) << format.reason();
  EXPECT_EQ(format->text(), "timestamp (float64): nanoseconds, absolute");
}

TEST(PointTime, LivoxMessagesMustNotHaveEqualTimesEither) {
  const auto observe = [](std::uint32_t step) {
    std::vector<TinyLivoxPoint> cloud(points);
    for (std::uint32_t i = 0; i < points; ++i) cloud[i].offset_time = i * step;
    return *observe_livox(tiny_livox(time_from_ns(5'000'000'000), 5'000'000'000, cloud));
  };
  EXPECT_EQ(detect_livox_point_time({observe(0)}).reason(), "the point times are all equal (field offset_time)");
  const auto format = detect_livox_point_time({observe(0), observe(500'000)});
  ASSERT_TRUE(format);
  EXPECT_EQ(format->text(), "offset_time (uint32): nanoseconds, from the scan's start");
}

}  // namespace point_time_test
}  // namespace kilvo::lab
