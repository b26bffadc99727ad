// sensor_msgs/Image -> CameraImage with 1 (grey) or 3 (red, green, blue) channels.
#pragma once

#include "kilvo/sensors/measurement.hpp"
#include "lab/messages/decoded.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// Larger images, raw or compressed, are refused: 24 megapixels.
inline constexpr std::size_t most_pixels = 24'000'000;

/// Encodings: mono8 8UC1 mono16 rgb8 bgr8 8UC3 rgba8 bgra8 8UC4 bayer_{rggb,bggr,gbrg,grbg}8 yuv422 yuv422_yuy2. Of mono16 the high byte
/// is kept; 8UC3 and 8UC4 are taken as blue first, as OpenCV has them; alpha is dropped.
Decoded<CameraImage> decode_image(const WireMessage& message);

}  // namespace kilvo::lab
