#include "apps/live/ring.hpp"

#include <gtest/gtest.h>
#include <thread>

#include "apps/live/handover.hpp"

namespace kilvo::live {
namespace ring_test {

TEST(Ring, HandsOverEverythingInOrderFromOneThreadToAnother) {
  constexpr int many = 100000;
  Ring<int> ring(7);
  std::thread writer([&ring] {
    for (int i = 0; i < many;) {
      int* slot = ring.vacant();
      if (slot == nullptr) continue;
      *slot = i++;
      ring.push();
    }
  });
  for (int expected = 0; expected < many;) {
    const int* slot = ring.front();
    if (slot == nullptr) continue;
    ASSERT_EQ(*slot, expected++);
    ring.pop();
  }
  writer.join();
  EXPECT_EQ(ring.front(), nullptr);
}

TEST(Ring, HasNoVacantSlotWhenAllAreFull) {
  Ring<int> ring(3);
  for (int i = 0; i < 3; ++i) {
    ASSERT_NE(ring.vacant(), nullptr);
    ring.push();
  }
  EXPECT_EQ(ring.vacant(), nullptr);
  ring.pop();
  EXPECT_NE(ring.vacant(), nullptr);
}

TEST(Handover, TheReaderSeesWholeValuesThatNeverGoBack) {
  struct Pair {
    long a = 0, b = 0;
  };
  constexpr long many = 100000;
  Handover<Pair> handover(Pair{});
  std::thread writer([&handover] {
    for (long i = 1; i <= many; ++i) {
      handover.back() = {i, -i};
      handover.publish();
    }
  });
  long last = 0;
  while (last < many) {
    if (!handover.fetch()) continue;
    const Pair& now = handover.front();
    ASSERT_EQ(now.a, -now.b);
    ASSERT_GT(now.a, last);
    last = now.a;
  }
  writer.join();
  EXPECT_FALSE(handover.fetch()) << "each value is given once";
}

}  // namespace ring_test
}  // namespace kilvo::live
