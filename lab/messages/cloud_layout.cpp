#include "lab/messages/cloud_layout.hpp"

#include <array>
#include <optional>

#include "lab/messages/point_cloud2.hpp"
#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_reader.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t most_cloud_fields = 256;

std::optional<ScalarType> scalar_type(std::uint8_t code, std::uint32_t count) {
  if (code < 1 || code > 8) return std::nullopt;
  const auto type = static_cast<ScalarType>(code);
  return type == ScalarType::uint32 && count == 2 ? ScalarType::uint64 : type;
}

/// Rows that are claimed longer or shorter than they are ("row_step lies") are repaired where there is only one way to read them.
Decoded<std::size_t> true_row_step(const CloudLayout& cloud) {
  const std::size_t row_bytes = cloud.width * cloud.point_step;  // both below 2^32
  if (row_bytes > cloud.data.size()) return bad_cloud("a row of points is longer than the data");
  if (cloud.height <= 1) return row_bytes;
  const bool as_claimed = cloud.row_step >= row_bytes && cloud.row_step <= (cloud.data.size() - row_bytes) / (cloud.height - 1);
  if (as_claimed) return cloud.row_step;
  if (row_bytes > 0 && cloud.height == cloud.data.size() / row_bytes && cloud.data.size() % row_bytes == 0) return row_bytes;
  return bad_cloud("row_step " + std::to_string(cloud.row_step) + " does not fit " + std::to_string(cloud.data.size()) + " bytes of data");
}

}  // namespace

DecodeError bad_cloud(const std::string& what) { return {"sensor_msgs/PointCloud2: " + what}; }

std::size_t size_of(ScalarType type) {
  constexpr std::array<std::size_t, 10> sizes{0, 1, 1, 2, 2, 4, 4, 4, 8, 8};
  return sizes[static_cast<std::size_t>(type)];
}

const char* name_of(ScalarType type) {
  constexpr const char* names[] = {"", "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64", "uint64"};
  return names[static_cast<std::size_t>(type)];
}

const CloudField* CloudLayout::find(std::string_view name) const {
  const auto it = std::ranges::find(fields, name, &CloudField::name);
  return it == fields.end() ? nullptr : &*it;
}

Decoded<CloudLayout> read_cloud_layout(const WireMessage& message) {
  const auto m = read_message<PointCloud2Message>(message);
  if (!m) return DecodeError{m.reason()};
  if (m->point_fields.size() > most_cloud_fields) return bad_cloud("claims " + std::to_string(m->point_fields.size()) + " fields");
  CloudLayout cloud;
  cloud.stamp = m->header.stamp;
  cloud.height = m->height;
  cloud.width = m->width;
  for (const PointFieldMessage& field : m->point_fields) {
    if (const auto type = scalar_type(field.datatype, field.count)) cloud.fields.push_back({field.name, field.offset, *type});
  }
  cloud.big_endian = m->is_bigendian != 0;
  cloud.point_step = m->point_step;
  cloud.row_step = m->row_step;
  cloud.data = m->data.raw;  // is_dense is not to be relied upon

  if (cloud.width == 0 || cloud.height == 0) cloud.width = cloud.height = 0;
  if (cloud.width != 0 && cloud.point_step == 0) return bad_cloud("point_step is 0");
  const auto row_step = true_row_step(cloud);
  if (!row_step) return DecodeError{row_step.reason()};
  cloud.row_step = *row_step;
  if (cloud.size() > most_points_in_a_cloud) return bad_cloud("claims " + std::to_string(cloud.size()) + " points");
  std::erase_if(cloud.fields, [&](const CloudField& f) { return f.offset + size_of(f.type) > cloud.point_step; });
  return cloud;
}

}  // namespace kilvo::lab
