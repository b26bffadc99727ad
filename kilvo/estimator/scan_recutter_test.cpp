#include "kilvo/estimator/scan_recutter.hpp"

#include <gtest/gtest.h>

#include "kilvo/input/timeline.hpp"

namespace kilvo {
namespace scan_recutter_test {

using std::chrono::milliseconds;

constexpr Time start{std::chrono::seconds(100)};

// A point each millisecond, whose x is its time in milliseconds.
LidarScan scan_from(int ms) {
  LidarScan out{start + milliseconds(ms), {}};
  for (int i = 0; i < 100; ++i) out.points.push_back({.x = static_cast<float>(ms + i), .offset_ns = i * 1'000'000});
  return out;
}

TEST(ScanRecutter, EachScanEndsAtAnImageAndNoPointIsLost) {
  ScanRecutter recutter(milliseconds(110));
  std::vector<LidarScan> parts;
  for (int k = 0; k < 5; ++k) {
    recutter.add_image(start + milliseconds(100 * k + 60));
    for (LidarScan& part : recutter.add(scan_from(100 * k))) parts.push_back(std::move(part));
  }
  ASSERT_EQ(parts.size(), 5U);
  float expected = 0;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    EXPECT_EQ(end_of(parts[k]), start + milliseconds(100 * static_cast<int>(k) + 60));
    for (const LidarPoint& p : parts[k].points) {
      EXPECT_EQ(p.x, expected++);
      EXPECT_EQ(parts[k].t + Duration(p.offset_ns), start + milliseconds(static_cast<int>(p.x)));
    }
  }
}

TEST(ScanRecutter, WithoutImagesScansGoOn) {
  ScanRecutter recutter(milliseconds(110));
  recutter.add_image(start + milliseconds(30));
  std::size_t points = 0, scans = 0;
  for (int k = 0; k < 10; ++k) {
    for (const LidarScan& part : recutter.add(scan_from(100 * k))) {
      points += part.points.size();
      ++scans;
    }
  }
  EXPECT_GE(points, 800U);
  EXPECT_GE(scans, 5U);
}

}  // namespace scan_recutter_test
}  // namespace kilvo
