// sensor_msgs/CompressedImage (JPEG or PNG) -> CameraImage with 1 (grey) or 3 (red, green, blue) channels; of a JPEG in colour the greys,
// with its colours beside them.
#pragma once

#include "kilvo/sensors/measurement.hpp"
#include "lab/messages/decoded.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// JPEG and PNG are told apart by their first bytes, not by the format text, which drivers fill as they please. A picture that is cut
/// short or damaged is an error, even if half of it could be shown. At most `most_pixels` (raw_image.hpp) are ever allocated.
Decoded<CameraImage> decode_compressed_image(const WireMessage& message, bool with_colours = true);

/// The picture alone.
Decoded<Image> decode_jpeg(Bytes file, bool with_colours = true);
Decoded<Image> decode_png(Bytes file);

}  // namespace kilvo::lab
