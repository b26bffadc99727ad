#include "lab/messages/cloud_layout.hpp"

#include <array>
#include <optional>

#include "lab/messages/point_cloud2.hpp"
#include "lab/messages/ros_header.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t most_fields = 256;

std::optional<ScalarType> scalar_type(std::uint8_t code, std::uint32_t count) {
  if (code < 1 || code > 8) return std::nullopt;
  const auto type = static_cast<ScalarType>(code);
  return type == ScalarType::uint32 && count == 2 ? ScalarType::uint64 : type;
}

DecodeError bad(const std::string& what) { return {"sensor_msgs/PointCloud2: " + what}; }

/// Rows that are claimed longer or shorter than they are ("row_step lies") are repaired where there is only one way to read them.
Decoded<std::size_t> true_row_step(const CloudLayout& cloud) {
  const std::size_t row_bytes = cloud.width * cloud.point_step;  // both below 2^32
  if (row_bytes > cloud.data.size()) return bad("a row of points is longer than the data");
  if (cloud.height <= 1) return row_bytes;
  const bool as_claimed = cloud.row_step >= row_bytes && cloud.row_step <= (cloud.data.size() - row_bytes) / (cloud.height - 1);
  if (as_claimed) return cloud.row_step;
  if (row_bytes > 0 && cloud.height == cloud.data.size() / row_bytes && cloud.data.size() % row_bytes == 0) return row_bytes;
  return bad("row_step " + std::to_string(cloud.row_step) + " does not fit " + std::to_string(cloud.data.size()) + " bytes of data");
}

}  // namespace

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

Decoded<CloudLayout> read_cloud_layout(Bytes message) {
  ByteReader reader(message);
  CloudLayout cloud;
  cloud.stamp = read_ros_header(reader).stamp;
  cloud.height = reader.read<std::uint32_t>();
  cloud.width = reader.read<std::uint32_t>();
  const std::size_t field_count = reader.read<std::uint32_t>();
  if (field_count > most_fields) return bad("claims " + std::to_string(field_count) + " fields");
  for (std::size_t i = 0; i < field_count && reader.ok(); ++i) {
    CloudField field;
    field.name = reader.string();
    field.offset = reader.read<std::uint32_t>();
    const auto code = reader.read<std::uint8_t>();
    const auto type = scalar_type(code, reader.read<std::uint32_t>());
    if (type) field.type = *type;
    if (type && reader.ok()) cloud.fields.push_back(field);
  }
  cloud.big_endian = reader.read<std::uint8_t>() != 0;
  cloud.point_step = reader.read<std::uint32_t>();
  cloud.row_step = reader.read<std::uint32_t>();
  cloud.data = reader.array();
  reader.skip(1);  // is_dense: said, but not to be relied upon
  if (!reader.ok()) return bad("the message ends before its data does");
  if (reader.remaining() != 0) return bad(std::to_string(reader.remaining()) + " bytes left over at the end");

  if (cloud.width == 0 || cloud.height == 0) cloud.width = cloud.height = 0;
  if (cloud.width != 0 && cloud.point_step == 0) return bad("point_step is 0");
  const auto row_step = true_row_step(cloud);
  if (!row_step) return DecodeError{row_step.reason()};
  cloud.row_step = *row_step;
  if (cloud.size() > most_points_in_a_cloud) return bad("claims " + std::to_string(cloud.size()) + " points");
  std::erase_if(cloud.fields, [&](const CloudField& f) { return f.offset + size_of(f.type) > cloud.point_step; });
  return cloud;
}

}  // namespace kilvo::lab
