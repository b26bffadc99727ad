#include "apps/ros1/clouds.hpp"

#include <bit>
#include <cstring>

namespace kilvo::ros1 {
namespace {

struct PackedPoint {
  float x, y, z;
  float fourth;
};

CloudMessage empty_cloud(std::size_t points, Time t, const std::string& frame, const char* fourth) {
  CloudMessage out;
  out.header.stamp = ros_time(t);
  out.header.frame_id = std::string_view(frame);
  out.height = 1;
  out.width = static_cast<std::uint32_t>(points);
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", fourth}) {
    CloudField field;
    field.name = name;
    field.offset = offset;
    field.datatype = CloudField::FLOAT32;
    field.count = 1;
    out.fields.push_back(field);
    offset += sizeof(float);
  }
  out.point_step = sizeof(PackedPoint);
  out.row_step = out.point_step * out.width;
  out.is_dense = 1;
  out.data.resize(points * sizeof(PackedPoint));
  return out;
}

void put(CloudMessage& cloud, std::size_t i, const PackedPoint& point) {
  std::memcpy(cloud.data.data() + i * sizeof point, &point, sizeof point);
}

}  // namespace

CloudMessage cloud_message(std::span<const PointXYZI> points, Time t, const std::string& frame) {
  CloudMessage out = empty_cloud(points.size(), t, frame, "intensity");
  for (std::size_t i = 0; i < points.size(); ++i) put(out, i, {points[i].x(), points[i].y(), points[i].z(), points[i].w()});
  return out;
}

CloudMessage cloud_message(std::span<const ColouredPoint> points, Time t, const std::string& frame) {
  CloudMessage out = empty_cloud(points.size(), t, frame, "rgb");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [p_W, rgb, weight] = points[i];
    const std::uint32_t packed = std::uint32_t{rgb[0]} << 16 | std::uint32_t{rgb[1]} << 8 | std::uint32_t{rgb[2]};
    put(out, i, {p_W.x(), p_W.y(), p_W.z(), std::bit_cast<float>(packed)});
  }
  return out;
}

}  // namespace kilvo::ros1
