#include "lab/messages/repeated_points.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>

namespace kilvo::lab {
namespace {

constexpr std::uint64_t one_of = 16;              // points are compared
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

// Rays without an echo are at the origin, or not finite: alike in every scan.
bool has_place(const LidarPoint& p) { return p.x * p.x + p.y * p.y + p.z * p.z > 0; }

}  // namespace

std::size_t RepeatedPoints::take_out(LidarScan& scan) {
  now_.clear();
  const std::int64_t stamp = to_ns(scan.t), until = newest_;
  for (const LidarPoint& p : scan.points) {
    if (const std::uint64_t place = place_of(p); place % one_of == 0 && has_place(p)) now_.push_back({place, stamp + p.offset_ns});
  }
  std::ranges::sort(now_, {}, &Seen::place);
  const auto is_repeated = [this](const Seen& seen) {
    const auto same = std::ranges::equal_range(before_, seen.place, {}, &Seen::place);
    return std::ranges::any_of(same, [&seen](const Seen& other) { return std::abs(other.t - seen.t) < same_time; });
  };
  const auto repeated = static_cast<std::size_t>(std::ranges::count_if(now_, is_repeated));
  if (!scan.points.empty()) newest_ = stamp + offsets_of(scan).last;
  std::swap(before_, now_);
  if (repeated < fewest || repeated * most_by_chance_one_of < before_.size()) return 0;
  scan.offsets.reset();
  return std::erase_if(scan.points, [&](const LidarPoint& p) { return stamp + p.offset_ns <= until; });
}

}  // namespace kilvo::lab
