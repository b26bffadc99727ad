// How pixels may be laid out in a sensor_msgs/Image, and how each layout becomes grey or red-green-blue.
#pragma once

#include <string_view>

#include "kilvo/sensors/image.hpp"
#include "lab/messages/bytes.hpp"

namespace kilvo::lab {

/// The data of an image message. `data` holds height rows of `step` bytes (the last row may end with its last pixel).
struct RawPixels {
  std::size_t width = 0, height = 0;
  std::size_t step = 0;
  bool big_endian = false;
  Bytes data;

  const std::uint8_t* row(std::size_t y) const { return data.data() + y * step; }
};

struct PixelFormat {
  std::string_view encoding;  // as in sensor_msgs/image_encodings.h
  std::size_t bytes_per_pixel;
  Image (*convert)(const RawPixels&);
};

/// Null for an encoding that is not read.
const PixelFormat* find_pixel_format(std::string_view encoding);

}  // namespace kilvo::lab
