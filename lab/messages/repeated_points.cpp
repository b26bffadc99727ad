#include "lab/messages/repeated_points.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace kilvo::lab {
namespace {

constexpr std::int64_t same_time = 1000;          // ns: a double holds the time of day to 256 ns
constexpr std::size_t fewest = 10;                // that are compared, so that it is no chance
constexpr std::size_t most_by_chance_one_of = 4;  // of those

// splitmix64 of the bits: Sebastiano Vigna, "An experimental exploration of Marsaglia's xorshift generators, scrambled", 2016.
std::uint64_t place_of(const LidarPoint& p) {
  std::uint64_t h = 0;
  for (const float x : {p.x, p.y, p.z}) {
    h = (h ^ std::bit_cast<std::uint32_t>(x)) + 0x9e3779b97f4a7c15U;
    h = (h ^ (h >> 30U)) * 0xbf58476d1ce4e5b9U;
    h = (h ^ (h >> 27U)) * 0x94d049bb133111ebU;
    h ^= h >> 31U;
  }
  return h;
}

// One of sixteen, by the bits of x.
bool is_compared(const LidarPoint& p) { return std::bit_cast<std::uint32_t>(p.x) * 0x9e3779b1U >> 28U == 0; }

// Rays without an echo are at the origin, or not finite: alike in every scan.
bool has_place(const LidarPoint& p) { return p.x * p.x + p.y * p.y + p.z * p.z > 0; }

}  // namespace

std::size_t RepeatedPoints::take_out(LidarScan& scan) {
  now_.clear();
  const std::int64_t stamp = to_ns(scan.t), until = newest_;
  for (const LidarPoint& p : scan.points) {
    if (is_compared(p) && has_place(p)) now_.push_back({place_of(p), stamp + p.offset_ns});
  }
  const OffsetRange offsets = offsets_of(scan);
  // What was measured later than all of the scan before is not in it.
  const std::size_t repeated = stamp + offsets.first < until + same_time ? count_repeated() : 0;
  if (!scan.points.empty()) newest_ = stamp + offsets.last;
  std::swap(before_, now_);
  if (repeated < fewest || repeated * most_by_chance_one_of < before_.size()) return 0;
  scan.offsets.reset();
  return std::erase_if(scan.points, [&](const LidarPoint& p) { return stamp + p.offset_ns <= until; });
}

// Both lists are walked once: a driver may put all rays without an echo at one place.
std::size_t RepeatedPoints::count_repeated() {
  const auto order = [](const Seen& s) { return std::pair(s.place, s.t); };
  std::ranges::sort(before_, {}, order);
  std::ranges::sort(now_, {}, order);
  std::size_t repeated = 0;
  auto other = before_.begin();
  for (const Seen& seen : now_) {
    const std::pair earliest(seen.place, seen.t - same_time + 1);
    while (other != before_.end() && order(*other) < earliest) ++other;
    if (other != before_.end() && other->place == seen.place && other->t < seen.t + same_time) ++repeated;
  }
  return repeated;
}

}  // namespace kilvo::lab
