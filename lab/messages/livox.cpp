#include "lab/messages/livox.hpp"

#include <cstdlib>

#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_reader.hpp"

namespace kilvo::lab {
namespace {

// Clocks that are one clock do not differ by more: the driver sets stamp and timebase from the same packet.
constexpr std::int64_t same_clock_ns = 1'000'000'000;

// The year 2116. A timebase beyond it is no time, and adding to it might overflow.
constexpr std::uint64_t latest_timebase = std::uint64_t{1} << 62;

struct Cloud {
  Time t{};
  std::int64_t first_offset_ns = 0;  // timebase minus t
  Structs<LivoxPoint> points;
};

Decoded<Cloud> read_cloud(const WireMessage& message) {
  const auto m = read_message<LivoxMessage>(message);
  if (!m) return DecodeError{m.reason()};
  Cloud cloud{m->header.stamp, 0, m->points};
  const std::int64_t timebase = m->timebase < latest_timebase ? static_cast<std::int64_t>(m->timebase) : 0;
  const std::size_t count = cloud.points.size();
  if (count > most_points_in_a_cloud) return DecodeError{"livox CustomMsg: claims " + std::to_string(count) + " points"};
  if (to_ns(cloud.t) == 0) cloud.t = time_from_ns(timebase);
  const bool same_clock = timebase > to_ns(cloud.t) - same_clock_ns && timebase < to_ns(cloud.t) + same_clock_ns;
  if (same_clock) cloud.first_offset_ns = timebase - to_ns(cloud.t);
  return cloud;
}

std::uint32_t offset_time(const std::uint8_t* point) {
  std::uint32_t offset;
  std::memcpy(&offset, point, sizeof offset);
  return offset;
}

LidarPoint read_point(const std::uint8_t* bytes) {
  float xyz[3];
  std::memcpy(xyz, bytes + 4, sizeof xyz);
  return {xyz[0], xyz[1], xyz[2], static_cast<float>(bytes[16]), 0};
}

}  // namespace

Decoded<PointTimeFormat> detect_livox_point_time(const std::vector<CloudTimes>& clouds) {
  for (const auto& cloud : clouds) {
    for (const auto& times : cloud.candidates) {
      if (times.high > times.low) return PointTimeFormat{times.field, times.type, TimeUnit::nanoseconds, TimeReference::scan_start, true};
    }
  }
  return DecodeError{"the point times are all equal (field offset_time)"};
}

Decoded<DecodedScan> decode_livox(const WireMessage& message, const PointTimeFormat& format) {
  const auto cloud = read_cloud(message);
  if (!cloud) return DecodeError{cloud.reason()};
  DecodedScan decoded;
  decoded.scan.t = cloud->t;
  auto& points = decoded.scan.points;
  points.resize(cloud->points.size());
  const bool timed = format.reference != TimeReference::none;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cloud->points.size(); ++i) {
    const std::uint8_t* bytes = cloud->points.at(i);
    const std::int64_t offset = timed ? cloud->first_offset_ns + offset_time(bytes) : 0;
    if (std::abs(offset) > farthest_point_time.count()) continue;
    points[kept] = read_point(bytes);
    points[kept++].offset_ns = static_cast<std::int32_t>(offset);
  }
  decoded.absurd_times = points.size() - kept;
  points.resize(kept);
  return decoded;
}

Decoded<CloudTimes> observe_livox(const WireMessage& message) {
  const auto cloud = read_cloud(message);
  if (!cloud) return DecodeError{cloud.reason()};
  CloudTimes times{cloud->t, cloud->points.size(), {"offset_time", "x", "y", "z", "reflectivity", "tag", "line"}, {}};
  if (times.points == 0) return times;
  double low = offset_time(cloud->points.at(0)), high = low;
  for (std::size_t i = 0; i < cloud->points.size(); ++i) {
    const double offset = offset_time(cloud->points.at(i));
    low = std::min(low, offset);
    high = std::max(high, offset);
  }
  times.candidates.push_back({"offset_time", "uint32", low, (low + high) / 2, high});
  return times;
}

}  // namespace kilvo::lab
