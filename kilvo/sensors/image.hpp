// A decoded image: rows from top to bottom, no padding.
#pragma once

#include <cstdint>
#include <vector>

namespace kilvo {

/// A grey level, or one of a colour, that may be saturated: the true one is unknown.
inline constexpr int overexposed = 250;

struct Image {
  int width = 0;                     // pixels
  int height = 0;                    // pixels
  int channels = 1;                  // 1 grey, 3 red-green-blue, interleaved
  std::vector<std::uint8_t> pixels;  // width * height * channels
  // Of a grey image that has colours beside its greys, as JPEG has them: blue differences, then red ones (Cb, Cr), both over all of it.
  int chroma_width = 0, chroma_height = 0;
  std::vector<std::uint8_t> chroma = {};

  bool empty() const { return pixels.empty(); }
};

}  // namespace kilvo
