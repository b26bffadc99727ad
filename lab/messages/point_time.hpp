// When was each point of a cloud measured? Drivers disagree about the field, its unit and what it counts from. The first clouds of a
// topic are looked at, the convention is decided once, printed, and kept.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kilvo/sensors/time.hpp"
#include "lab/messages/decoded.hpp"

namespace kilvo::lab {

enum class TimeUnit : std::uint8_t { seconds, milliseconds, microseconds, nanoseconds };

/// Nanoseconds in one unit.
constexpr std::int64_t nanoseconds_in(TimeUnit unit) {
  constexpr std::int64_t table[] = {1'000'000'000, 1'000'000, 1'000, 1};
  return table[static_cast<int>(unit)];
}

enum class TimeReference : std::uint8_t {
  none,         // no point times: every point is taken at the cloud's stamp
  scan_start,   // relative to the stamp, which is the scan's start (offsets positive)
  scan_end,     // relative to the stamp, which is the scan's end (offsets negative)
  absolute,     // on the clock of the stamp
  other_clock,  // on a clock that is not the stamp's: the earliest point of each cloud is taken at the stamp
};

/// A point whose time is farther than this from its cloud's stamp is not believed.
inline constexpr Duration farthest_point_time = std::chrono::seconds(2);

/// How the times of a topic's points are written.
struct PointTimeFormat {
  std::string field;  // empty: none
  std::string type;   // "float64"
  TimeUnit unit = TimeUnit::nanoseconds;
  TimeReference reference = TimeReference::none;
  bool usual_span = true;  // false: the unit is the likeliest, but the scan covers less than 0.2 of the scan period

  /// For people: "timestamp (float64): nanoseconds, absolute".
  std::string text() const;
};

/// The times in one cloud by one field that might be the point time, over its points with usable coordinates.
struct FieldTimes {
  std::string field;
  std::string type;
  double low = 0, middle = 0, high = 0;  // 2nd, 50th and 98th percentile: a few absurd values do not count
};

/// What the detection needs to know of one cloud.
struct CloudTimes {
  Time stamp{};
  std::size_t points = 0;
  std::vector<std::string> fields;     // every field of the cloud
  std::vector<FieldTimes> candidates;  // those that could be the point time; best names first
};

/// Clouds with more points than this must say when their points were measured; five of them are looked at.
inline constexpr std::size_t points_of_a_full_cloud = 100;
inline constexpr std::size_t clouds_to_look_at = 5;

/// The names that drivers give the point time, the least ambiguous first.
inline constexpr std::array<std::string_view, 6> point_time_names{"timestamp", "time", "t", "offset_time", "time_stamp", "stamps"};

/// Decides from the first clouds of a topic, in the order of arrival. The unit follows from the magnitude and from the span, which
/// must be 0.2 to 1.2 scan periods; the period from the stamps, or `nominal_period` for a single cloud. The error names the fields.
Decoded<PointTimeFormat> detect_point_time(const std::vector<CloudTimes>& clouds, Duration nominal_period);

}  // namespace kilvo::lab
