// For tests: PointCloud2 and Livox messages of any layout, right or wrong, built field by field.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "lab/messages/byte_writer.hpp"
#include "lab/messages/cloud_layout.hpp"

namespace kilvo::lab {

struct TinyField {
  std::string name;
  std::uint32_t offset = 0;
  ScalarType type = ScalarType::float32;
};

/// A sensor_msgs/PointCloud2 in the making. The default layout is x y z intensity, float32, and room for a point time at byte 16.
struct TinyCloud {
  Time stamp = time_from_ns(1'700'000'000'123'456'789);
  std::uint32_t height = 1, width = 0;
  std::uint32_t point_step = 24;
  std::optional<std::uint32_t> row_step;  // else width * point_step
  bool big_endian = false;
  std::vector<TinyField> fields{{"x", 0}, {"y", 4}, {"z", 8}, {"intensity", 12}};
  std::vector<std::uint8_t> data;

  /// Point i of n lies at (1 + i, 2, 3) with intensity i.
  static TinyCloud line(std::uint32_t points) {
    TinyCloud cloud;
    cloud.width = points;
    cloud.data.resize(std::size_t{points} * cloud.point_step);
    for (std::uint32_t i = 0; i < points; ++i) cloud.set_point(i, 1 + static_cast<float>(i), 2, 3, static_cast<float>(i));
    return cloud;
  }

  void set_point(std::size_t i, float x, float y, float z, float intensity) {
    set(i, 0, x);
    set(i, 4, y);
    set(i, 8, z);
    set(i, 12, intensity);
  }

  template <class T>
  void set(std::size_t point, std::size_t offset, T value) {
    std::uint8_t bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    if (big_endian) std::reverse(bytes, bytes + sizeof(T));
    const std::size_t row = row_step.value_or(width * point_step);
    std::memcpy(data.data() + point / width * row + point % width * point_step + offset, bytes, sizeof(T));
  }

  /// Adds a time field at byte 16 and sets it to time(i) for every point.
  template <class T, class Function>
  TinyCloud& with_times(const std::string& name, ScalarType type, Function time) {
    fields.push_back({name, 16, type});
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) set(i, 16, static_cast<T>(time(i)));
    return *this;
  }

  std::vector<std::uint8_t> bytes() const {
    ByteWriter writer;
    writer.put(std::uint32_t{7}).put_time(stamp).put_string("lidar").put(height).put(width);
    writer.put(static_cast<std::uint32_t>(fields.size()));
    for (const auto& field : fields) {
      const bool doubled = field.type == ScalarType::uint64;  // written as two uint32
      writer.put_string(field.name).put(field.offset);
      writer.put(static_cast<std::uint8_t>(doubled ? ScalarType::uint32 : field.type)).put(std::uint32_t{doubled ? 2U : 1U});
    }
    writer.put(static_cast<std::uint8_t>(big_endian)).put(point_step).put(row_step.value_or(width * point_step));
    writer.put(static_cast<std::uint32_t>(data.size())).append(data.data(), data.size()).put(std::uint8_t{0});
    return writer.take();
  }
};

struct TinyLivoxPoint {
  std::uint32_t offset_time = 0;
  float x = 1, y = 2, z = 3;
  std::uint8_t reflectivity = 10;
};

/// A livox_ros_driver/CustomMsg.
inline std::vector<std::uint8_t> tiny_livox(Time stamp, std::uint64_t timebase, const std::vector<TinyLivoxPoint>& points) {
  const auto count = static_cast<std::uint32_t>(points.size());
  ByteWriter writer;
  writer.put(std::uint32_t{7}).put_time(stamp).put_string("livox").put(timebase).put(count).put(std::uint32_t{0}).put(count);
  for (const auto& p : points) {
    writer.put(p.offset_time).put(p.x).put(p.y).put(p.z).put(p.reflectivity).put(std::uint8_t{0x10}).put(std::uint8_t{1});
  }
  return writer.take();
}

}  // namespace kilvo::lab
