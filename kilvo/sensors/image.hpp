// A decoded image: rows from top to bottom, no padding.
#pragma once

#include <cstdint>
#include <vector>

namespace kilvo {

struct Image {
  int width = 0;                     // pixels
  int height = 0;                    // pixels
  int channels = 1;                  // 1 grey, 3 red-green-blue, interleaved
  std::vector<std::uint8_t> pixels;  // width * height * channels

  bool empty() const { return pixels.empty(); }
};

}  // namespace kilvo
