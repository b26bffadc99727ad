// The bytes of a sensor_msgs/PointCloud2, checked once, so that its columns can then be read without further checks.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "kilvo/sensors/time.hpp"
#include "lab/messages/decoded.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// Types of sensor_msgs/PointField, and two uint32 in a row, which some drivers use for a uint64.
enum class ScalarType : std::uint8_t { int8 = 1, uint8, int16, uint16, int32, uint32, float32, float64, uint64 };

std::size_t size_of(ScalarType type);
const char* name_of(ScalarType type);

struct CloudField {
  std::string_view name;
  std::size_t offset = 0;
  ScalarType type = ScalarType::float32;
};

struct CloudLayout {
  Time stamp{};
  std::size_t height = 0, width = 0;
  std::size_t point_step = 0, row_step = 0;  // bytes; row_step is at least width * point_step
  bool big_endian = false;
  Bytes data;                      // holds every point
  std::vector<CloudField> fields;  // those that lie within a point

  std::size_t size() const { return height * width; }
  const CloudField* find(std::string_view name) const;
};

/// Says of which type it is.
DecodeError bad_cloud(const std::string& what);

/// Fails unless all the points that the message claims are really in it.
Decoded<CloudLayout> read_cloud_layout(const WireMessage& message);

/// Calls store(i, value) for each point i with the value of one column, as its own type.
template <class T, class Store>
void read_column_as(const CloudLayout& cloud, std::size_t offset, Store&& store) {
  std::size_t i = 0;
  for (std::size_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* at = cloud.data.data() + row * cloud.row_step + offset;
    if (!cloud.big_endian) {
      for (std::size_t column = 0; column < cloud.width; ++column, at += cloud.point_step) {
        T value;
        std::memcpy(&value, at, sizeof(T));
        store(i++, value);
      }
    } else {
      for (std::size_t column = 0; column < cloud.width; ++column, at += cloud.point_step) {
        std::uint8_t turned[sizeof(T)];
        std::reverse_copy(at, at + sizeof(T), turned);
        T value;
        std::memcpy(&value, turned, sizeof(T));
        store(i++, value);
      }
    }
  }
}

template <class Store>
void read_column(const CloudLayout& cloud, const CloudField& field, Store&& store) {
  switch (field.type) {
    case ScalarType::int8:
      return read_column_as<std::int8_t>(cloud, field.offset, store);
    case ScalarType::uint8:
      return read_column_as<std::uint8_t>(cloud, field.offset, store);
    case ScalarType::int16:
      return read_column_as<std::int16_t>(cloud, field.offset, store);
    case ScalarType::uint16:
      return read_column_as<std::uint16_t>(cloud, field.offset, store);
    case ScalarType::int32:
      return read_column_as<std::int32_t>(cloud, field.offset, store);
    case ScalarType::uint32:
      return read_column_as<std::uint32_t>(cloud, field.offset, store);
    case ScalarType::float32:
      return read_column_as<float>(cloud, field.offset, store);
    case ScalarType::float64:
      return read_column_as<double>(cloud, field.offset, store);
    case ScalarType::uint64:
      return read_column_as<std::uint64_t>(cloud, field.offset, store);
  }
}

}  // namespace kilvo::lab
