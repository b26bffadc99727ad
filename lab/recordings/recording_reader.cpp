#include "lab/recordings/recording_reader.hpp"

#include <algorithm>

namespace kilvo::lab {
namespace {

constexpr std::int64_t latest = 8'000'000'000'000'000'000;

}  // namespace

Time recorded_time(std::uint64_t ns) { return time_from_ns(static_cast<std::int64_t>(std::min<std::uint64_t>(ns, latest))); }
Time recorded_time(std::int64_t ns) { return time_from_ns(std::clamp<std::int64_t>(ns, 0, latest)); }

void TimesSummary::add(Time t) {
  if (count == 0) {
    first = last = t;
  } else if (t >= last) {
    largest_gap = std::max(largest_gap, t - last);
    last = t;
  } else {
    first = std::min(first, t);
  }
  ++count;
}

void TimesSummary::append(const TimesSummary& later) {
  if (count == 0) {
    *this = later;
    return;
  }
  if (later.count == 0) return;
  largest_gap = std::max({largest_gap, later.largest_gap, later.first - last});
  first = std::min(first, later.first);
  last = std::max(last, later.last);
  count += later.count;
}

}  // namespace kilvo::lab
