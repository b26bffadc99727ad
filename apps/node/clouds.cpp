#include "apps/node/clouds.hpp"

#include <bit>
#include <cstring>

namespace kilvo::node {
namespace {

struct PackedPoint {
  float x, y, z;
  float fourth;
};

PointCloud empty_cloud(std::size_t points, Time t, const std::string& frame, const char* fourth) {
  PointCloud out;
  out.header = {{}, t, frame};
  out.width = static_cast<std::uint32_t>(points);
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", fourth}) {
    out.point_fields.push_back({name, offset});
    offset += sizeof(float);
  }
  out.point_step = sizeof(PackedPoint);
  out.row_step = out.point_step * out.width;
  out.data.resize(points * sizeof(PackedPoint));
  return out;
}

void put(PointCloud& cloud, std::size_t i, const PackedPoint& point) {
  std::memcpy(cloud.data.data() + i * sizeof point, &point, sizeof point);
}

}  // namespace

PointCloud cloud_message(std::span<const PointXYZI> points, Time t, const std::string& frame) {
  PointCloud out = empty_cloud(points.size(), t, frame, "intensity");
  for (std::size_t i = 0; i < points.size(); ++i) put(out, i, {points[i].x(), points[i].y(), points[i].z(), points[i].w()});
  return out;
}

PointCloud cloud_message(std::span<const ColouredPoint> points, Time t, const std::string& frame) {
  PointCloud out = empty_cloud(points.size(), t, frame, "rgb");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [p_W, rgb, weight] = points[i];
    const std::uint32_t packed = std::uint32_t{rgb[0]} << 16 | std::uint32_t{rgb[1]} << 8 | std::uint32_t{rgb[2]};
    put(out, i, {p_W.x(), p_W.y(), p_W.z(), std::bit_cast<float>(packed)});
  }
  return out;
}

}  // namespace kilvo::node
