#include "lab/messages/point_cloud2.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include "lab/messages/cloud_layout.hpp"

namespace kilvo::lab {
namespace {

constexpr double farthest_ns = static_cast<double>(farthest_point_time.count());
constexpr std::int32_t no_offset = std::numeric_limits<std::int32_t>::max();  // marks a point whose time is absurd

std::string field_names(const CloudLayout& cloud) {
  std::string names;
  for (const auto& field : cloud.fields) names.append(" ").append(field.name);
  return names;
}

/// Fills coordinates and intensity; the offsets stay 0.
bool read_geometry(const CloudLayout& cloud, std::vector<LidarPoint>& points) {
  const CloudField* x = cloud.find("x");
  const CloudField* y = cloud.find("y");
  const CloudField* z = cloud.find("z");
  if (x == nullptr || y == nullptr || z == nullptr) return false;
  points.resize(cloud.size());
  const CloudField* intensity = cloud.find("intensity");
  if (intensity == nullptr) intensity = cloud.find("reflectivity");
  const auto is_plain = [&](const CloudField* field) { return !cloud.big_endian && field->type == ScalarType::float32; };
  if (intensity != nullptr && is_plain(x) && is_plain(y) && is_plain(z) && is_plain(intensity)) {
    // As nearly all drivers have it: in one pass.
    LidarPoint* p = points.data();
    for (std::size_t row = 0; row < cloud.height; ++row) {
      const std::uint8_t* at = cloud.data.data() + row * cloud.row_step;
      for (std::size_t column = 0; column < cloud.width; ++column, at += cloud.point_step, ++p) {
        std::memcpy(&p->x, at + x->offset, sizeof(float));
        std::memcpy(&p->y, at + y->offset, sizeof(float));
        std::memcpy(&p->z, at + z->offset, sizeof(float));
        std::memcpy(&p->intensity, at + intensity->offset, sizeof(float));
      }
    }
    return true;
  }
  read_column(cloud, *x, [&](std::size_t i, auto value) { points[i].x = static_cast<float>(value); });
  read_column(cloud, *y, [&](std::size_t i, auto value) { points[i].y = static_cast<float>(value); });
  read_column(cloud, *z, [&](std::size_t i, auto value) { points[i].z = static_cast<float>(value); });
  if (intensity != nullptr)
    read_column(cloud, *intensity, [&](std::size_t i, auto value) { points[i].intensity = static_cast<float>(value); });
  return true;
}

/// True for points that the sensor really saw; organised clouds fill the rest with NaN or zeros, and their times with anything.
bool is_real(const LidarPoint& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && (p.x != 0 || p.y != 0 || p.z != 0);
}

/// The values of one field over the real points.
std::vector<double> values_of(const CloudLayout& cloud, const CloudField& field, const std::vector<LidarPoint>& points) {
  std::vector<double> values;
  values.reserve(points.size());
  read_column(cloud, field, [&](std::size_t i, auto value) {
    const auto v = static_cast<double>(value);
    if (std::isfinite(v) && is_real(points[i])) values.push_back(v);
  });
  return values;
}

double percentile(std::vector<double>& values, double fraction) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

/// The value that corresponds to the stamp, in the field's own unit, and what must still be subtracted, in nanoseconds. Splitting it
/// this way keeps the difference of two times of 1.7e18 ns exact, though a double holds such a time to 256 ns only.
struct Origin {
  double value = 0;
  double rest_ns = 0;
};

Origin origin_of(const CloudLayout& cloud, const CloudField& field, const PointTimeFormat& format, const std::vector<LidarPoint>& points) {
  const std::int64_t scale = nanoseconds_in(format.unit);
  if (format.reference == TimeReference::absolute) {
    const std::int64_t stamp = to_ns(cloud.stamp);
    const std::int64_t whole = stamp / scale;
    const auto value = static_cast<double>(whole);
    return {value, static_cast<double>(stamp - static_cast<std::int64_t>(value) * scale)};
  }
  if (format.reference == TimeReference::other_clock) {
    auto values = values_of(cloud, field, points);
    if (values.empty()) return {};
    // The earliest of those that belong together: an invalid point with time 0 must not become the origin.
    const double middle = percentile(values, 0.5);
    double first = middle;
    for (const double v : values) {
      if (std::abs(v - middle) * static_cast<double>(scale) < farthest_ns) first = std::min(first, v);
    }
    return {first, 0};
  }
  return {};
}

void read_offsets(const CloudLayout& cloud, const CloudField& field, const PointTimeFormat& format, std::vector<LidarPoint>& points) {
  const Origin origin = origin_of(cloud, field, format, points);
  const auto scale = static_cast<double>(nanoseconds_in(format.unit));
  read_column(cloud, field, [&](std::size_t i, auto value) {
    const double offset = (static_cast<double>(value) - origin.value) * scale - origin.rest_ns;
    const bool believable = std::abs(offset) <= farthest_ns;  // false for NaN too
    points[i].offset_ns = believable ? static_cast<std::int32_t>(std::lrint(offset)) : no_offset;
  });
}

}  // namespace

Decoded<DecodedScan> decode_point_cloud2(const WireMessage& message, const PointTimeFormat& format) {
  const auto cloud = read_cloud_layout(message);
  if (!cloud) return DecodeError{cloud.reason()};
  DecodedScan decoded;
  auto& points = decoded.scan.points;
  decoded.scan.t = cloud->stamp;
  if (!read_geometry(*cloud, points)) return bad_cloud("x, y or z is missing among the fields:" + field_names(*cloud));
  if (format.reference == TimeReference::none) return decoded;

  const CloudField* time = cloud->find(format.field);
  if (time == nullptr) return bad_cloud("the point time " + format.field + " is missing among the fields:" + field_names(*cloud));
  read_offsets(*cloud, *time, format, points);
  decoded.absurd_times = std::erase_if(points, [](const LidarPoint& p) { return p.offset_ns == no_offset; });
  return decoded;
}

Decoded<CloudTimes> observe_point_cloud2(const WireMessage& message) {
  const auto cloud = read_cloud_layout(message);
  if (!cloud) return DecodeError{cloud.reason()};
  CloudTimes times{cloud->stamp, cloud->size(), {}, {}};
  for (const auto& field : cloud->fields) times.fields.emplace_back(field.name);
  std::vector<LidarPoint> points;
  if (!read_geometry(*cloud, points)) return bad_cloud("x, y or z is missing among the fields:" + field_names(*cloud));
  for (const std::string_view name : point_time_names) {
    const CloudField* field = cloud->find(name);
    if (field == nullptr) continue;
    auto values = values_of(*cloud, *field, points);
    if (values.empty()) continue;
    times.candidates.push_back(
        {std::string(name), name_of(field->type), percentile(values, 0.02), percentile(values, 0.5), percentile(values, 0.98)});
  }
  return times;
}

}  // namespace kilvo::lab
