#include "lab/messages/livox.hpp"

#include <gtest/gtest.h>

#include "lab/messages/tiny_cloud.hpp"

namespace kilvo::lab {
namespace livox_test {

const Time stamp = time_from_ns(1'700'000'000'000'000'000);
const auto stamp_ns = static_cast<std::uint64_t>(to_ns(stamp));
const PointTimeFormat timed{"offset_time", "uint32", TimeUnit::nanoseconds, TimeReference::scan_start, true};

TEST(DecodeLivox, ReadsPointsWithReflectivityAsIntensity) {
  const auto decoded = decode_livox(tiny_livox(stamp, stamp_ns, {{100, 1, 2, 3, 42}, {99'000'000, -1, -2, -3, 255}}), timed);
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_EQ(decoded->scan.t, stamp);
  ASSERT_EQ(decoded->scan.points.size(), 2U);
  const LidarPoint& p = decoded->scan.points[1];
  EXPECT_EQ(p.x, -1);
  EXPECT_EQ(p.y, -2);
  EXPECT_EQ(p.z, -3);
  EXPECT_EQ(p.intensity, 255);
  EXPECT_EQ(p.offset_ns, 99'000'000);
}

TEST(DecodeLivox, OffsetsCountFromTheStampWhereTimebaseIsOnItsClock) {
  const auto decoded = decode_livox(tiny_livox(stamp, stamp_ns - 3'000'000, {{1'000'000}}), timed);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->scan.points[0].offset_ns, -2'000'000);
}

TEST(DecodeLivox, TimebaseOfAnotherClockIsTakenToBeTheStamp) {
  for (const std::uint64_t timebase : {std::uint64_t{0}, std::uint64_t{77'000'000'000}, ~std::uint64_t{0}, std::uint64_t{1} << 63}) {
    const auto decoded = decode_livox(tiny_livox(stamp, timebase, {{1'000'000}}), timed);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->scan.t, stamp);
    ASSERT_EQ(decoded->scan.points.size(), 1U);
    EXPECT_EQ(decoded->scan.points[0].offset_ns, 1'000'000);
  }
}

TEST(DecodeLivox, WithoutAStampTimebaseIsTheTime) {
  const auto decoded = decode_livox(tiny_livox(Time{}, stamp_ns, {{5}}), timed);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->scan.t, stamp);
  EXPECT_EQ(decoded->scan.points[0].offset_ns, 5);
}

TEST(DecodeLivox, ATimebaseThatIsNoTimeIsNotUsed) {
  // Found by fuzzing: as a signed number this is so far in the past that a second before it does not exist.
  const auto decoded = decode_livox(tiny_livox(Time{}, 0x8000000000040001, {{5}}), timed);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->scan.t, Time{});
  EXPECT_EQ(decoded->scan.points[0].offset_ns, 5);
}

TEST(DecodeLivox, PointsWithAbsurdTimesAreDroppedAndCounted) {
  const auto bytes = tiny_livox(stamp, stamp_ns, {{1}, {2'000'000'001}, {4'000'000'000}, {2}});
  const auto decoded = decode_livox(bytes, timed);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->absurd_times, 2U);
  ASSERT_EQ(decoded->scan.points.size(), 2U);
  EXPECT_EQ(decoded->scan.points[1].offset_ns, 2);
  EXPECT_EQ(decode_livox(bytes, {})->scan.points.size(), 4U) << "without deskewing their times do not matter";
  EXPECT_EQ(decode_livox(bytes, {})->scan.points[3].offset_ns, 0);
}

TEST(DecodeLivox, RefusesEveryOtherLength) {
  auto bytes = tiny_livox(stamp, stamp_ns, {{1}, {2}});
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decode_livox(Bytes(bytes).first(size), timed)) << size;
  bytes.push_back(0);
  EXPECT_FALSE(decode_livox(bytes, timed));
}

TEST(DecodeLivox, AnEmptyCloudIsACloud) {
  const auto decoded = decode_livox(tiny_livox(stamp, stamp_ns, {}), timed);
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_TRUE(decoded->scan.points.empty());
}

}  // namespace livox_test
}  // namespace kilvo::lab
