#include "lab/messages/raw_image.hpp"

#include <algorithm>
#include <string>

#include "lab/messages/pixel_formats.hpp"
#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_reader.hpp"

namespace kilvo::lab {
namespace {

DecodeError bad_image(const std::string& what) { return {"sensor_msgs/Image: " + what}; }

}  // namespace

Decoded<CameraImage> decode_image(const WireMessage& message) {
  const auto m = read_message<ImageMessage>(message);
  if (!m) return DecodeError{m.reason()};
  const RawPixels raw{m->width, m->height, m->step, m->is_bigendian != 0, m->data.raw};
  const std::string_view encoding = m->encoding;
  CameraImage decoded;
  decoded.t = m->header.stamp;
  if (raw.width == 0 || raw.height == 0) return bad_image("the image is empty");
  if (raw.width > most_pixels / raw.height)
    return bad_image(std::to_string(raw.width) + "x" + std::to_string(raw.height) + " is too large");

  const PixelFormat* format = find_pixel_format(encoding);
  if (format == nullptr) return bad_image("encoding " + std::string(encoding.substr(0, 40)) + " is not read");
  const std::size_t row_bytes = raw.width * format->bytes_per_pixel;
  if (raw.step < row_bytes || raw.data.size() < row_bytes || (raw.data.size() - row_bytes) / raw.step < raw.height - 1) {
    return bad_image("step " + std::to_string(raw.step) + " and " + std::to_string(raw.data.size()) + " bytes do not hold the image");
  }
  decoded.image = format->convert(raw);
  return decoded;
}

}  // namespace kilvo::lab
