// Grey images and their pyramid, each level half the size of the one before, after a low-pass.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kilvo/sensors/image.hpp"

namespace kilvo {

struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;  // rows from top to bottom

  const std::uint8_t* row(int y) const { return pixels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width); }
  std::uint8_t at(int x, int y) const { return row(y)[x]; }
};

/// Grey from red, green, blue (ITU-R BT.601 weights), or the grey image itself.
GreyImage to_grey(const Image& image);

/// Half the size (rounded down), low-passed by the separable binomial filter 1 3 3 1 between the pixels, repeated at the borders: pixel u
/// of the half image lies at 2u + 0.5 of the whole one.
GreyImage half_of(const GreyImage& image);

/// Level 0 is the image itself. A level is not made when it would be smaller than 16 pixels.
std::vector<GreyImage> pyramid_of(GreyImage image, int levels);

/// Where a pixel of level 0 lies in a level.
inline Eigen::Vector2d at_level(const Eigen::Vector2d& pixel, int level) {
  const double scale = 1.0 / (1 << level);
  return scale * (pixel.array() + 0.5).matrix() - Eigen::Vector2d(0.5, 0.5);
}

/// Bilinear, in rows of `width` pixels; (x, y) must be at least 0 and at most (width - 1, height - 1) less a hair.
inline float sample(const std::uint8_t* pixels, int width, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float a = x - static_cast<float>(ix), b = y - static_cast<float>(iy);
  const std::uint8_t* upper = pixels + iy * width + ix;
  const std::uint8_t* lower = upper + width;
  const float top = static_cast<float>(upper[0]) + a * static_cast<float>(upper[1] - upper[0]);
  const float bottom = static_cast<float>(lower[0]) + a * static_cast<float>(lower[1] - lower[0]);
  return top + b * (bottom - top);
}

}  // namespace kilvo
