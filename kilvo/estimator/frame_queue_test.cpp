#include "kilvo/estimator/frame_queue.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace frame_queue_test {

using std::chrono::milliseconds;

constexpr Time zero{std::chrono::seconds(100)};

Time at_ms(int ms) { return zero + milliseconds(ms); }

// Of 100 ms.
LidarScan scan_from_ms(int ms) { return {at_ms(ms), {{.offset_ns = 0}, {.offset_ns = 100'000'000}}}; }

CameraImage image_at_ms(int ms) { return {at_ms(ms), {}}; }

struct Popped {
  Sensor sensor;
  Time end;
  bool operator==(const Popped&) const = default;
};

std::vector<Popped> popped(FrameQueue& queue, Time until) {
  std::vector<Popped> out;
  while (const auto frame = queue.pop(until)) {
    out.push_back({frame->sensor(), frame->end});
    if (frame->sensor() == Sensor::lidar) queue.scan_used(frame->middle());
  }
  return out;
}

TEST(FrameQueue, AFrameWaitsUntilTheImuIsAtItsEnd) {
  FrameQueue queue(10, true);
  queue.push(scan_from_ms(0));
  EXPECT_FALSE(queue.pop(at_ms(99)));
  EXPECT_EQ(popped(queue, at_ms(100)), (std::vector<Popped>{{Sensor::lidar, at_ms(100)}}));
  EXPECT_TRUE(queue.empty());
}

TEST(FrameQueue, FramesGoInTheOrderOfTheirTimesWhateverThatOfTheirArrival) {
  FrameQueue queue(10, true);
  queue.push(image_at_ms(160));
  queue.push(scan_from_ms(100));
  queue.push(image_at_ms(140));
  queue.push(scan_from_ms(0));
  // The middles of the scans are at 50 and 150 ms.
  const std::vector<Popped> expected = {
      {Sensor::lidar, at_ms(100)}, {Sensor::camera, at_ms(140)}, {Sensor::lidar, at_ms(200)}, {Sensor::camera, at_ms(160)}};
  EXPECT_EQ(popped(queue, at_ms(200)), expected);
}

TEST(FrameQueue, AnImageWaitsForTheScanThatItLiesInTheSecondHalfOf) {
  FrameQueue queue(10, true);
  queue.push(scan_from_ms(0));
  popped(queue, at_ms(100));
  queue.push(image_at_ms(140));
  EXPECT_EQ(popped(queue, at_ms(140)).size(), 1u) << "the next scan's middle is later";
  queue.push(image_at_ms(160));
  EXPECT_TRUE(popped(queue, at_ms(200)).empty());
  queue.push(scan_from_ms(100));
  EXPECT_EQ(popped(queue, at_ms(200)), (std::vector<Popped>{{Sensor::lidar, at_ms(200)}, {Sensor::camera, at_ms(160)}}));
}

TEST(FrameQueue, AnImageDoesNotWaitForAScanThatDoesNotCome) {
  for (const bool ended : {false, true}) {
    FrameQueue queue(10, true);
    queue.push(scan_from_ms(0));
    popped(queue, at_ms(100));
    queue.push(image_at_ms(160));
    if (ended) queue.end();
    EXPECT_EQ(popped(queue, at_ms(219)).size(), ended ? 1u : 0u);
    EXPECT_EQ(popped(queue, at_ms(220)).size(), ended ? 0u : 1u);
  }
}

TEST(FrameQueue, WithoutScansImagesGoAtOnce) {
  FrameQueue never(10, false), not_yet(10, true);
  for (FrameQueue* queue : {&never, &not_yet}) {
    queue->push(image_at_ms(60));
    EXPECT_EQ(popped(*queue, at_ms(60)).size(), 1u);
  }
}

TEST(FrameQueue, OfTooManyTheOldestIsGivenBack) {
  FrameQueue queue(10, true);
  for (int k = 1; k <= 60; ++k) EXPECT_FALSE(queue.push(image_at_ms(10 * k))) << k;
  EXPECT_FALSE(queue.push(scan_from_ms(1910))) << "two seconds";
  const auto oldest = queue.push(scan_from_ms(1915));
  ASSERT_TRUE(oldest);
  EXPECT_EQ(oldest->sensor(), Sensor::camera);
  EXPECT_EQ(oldest->end, at_ms(10));
  const auto itself = queue.push(scan_from_ms(-200));
  ASSERT_TRUE(itself);
  EXPECT_EQ(itself->end, at_ms(-100)) << "it is the oldest";
  EXPECT_EQ(queue.take_rest().size(), 61u);
  EXPECT_TRUE(queue.empty());
}

}  // namespace frame_queue_test
}  // namespace kilvo
