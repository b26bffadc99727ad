#include "lab/messages/pixel_formats.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace kilvo::lab {
namespace {

Image blank(const RawPixels& raw, int channels) {
  Image image;
  image.width = static_cast<int>(raw.width);
  image.height = static_cast<int>(raw.height);
  image.channels = channels;
  image.pixels.resize(raw.width * raw.height * static_cast<std::size_t>(channels));
  return image;
}

Image grey8(const RawPixels& raw) {
  Image image = blank(raw, 1);
  for (std::size_t y = 0; y < raw.height; ++y) std::copy_n(raw.row(y), raw.width, image.pixels.data() + y * raw.width);
  return image;
}

Image grey16(const RawPixels& raw) {
  Image image = blank(raw, 1);
  const std::size_t high = raw.big_endian ? 0 : 1;
  std::uint8_t* out = image.pixels.data();
  for (std::size_t y = 0; y < raw.height; ++y) {
    const std::uint8_t* in = raw.row(y) + high;
    for (std::size_t x = 0; x < raw.width; ++x) *out++ = in[2 * x];
  }
  return image;
}

using Bytes16 = std::uint8_t __attribute__((vector_size(16)));

/// Five pixels with red and blue in each other's place, and a byte that stays.
[[gnu::always_inline]] inline void swap_in_five(Bytes16& x) {
#ifdef __clang__
  x = __builtin_shufflevector(x, x, 2, 1, 0, 5, 4, 3, 8, 7, 6, 11, 10, 9, 14, 13, 12, 15);
#else
  x = __builtin_shuffle(x, Bytes16{2, 1, 0, 5, 4, 3, 8, 7, 6, 11, 10, 9, 14, 13, 12, 15});
#endif
}

/// Red and blue change places in `count` bytes of colours.
KILVO_WIDE void swap_red_and_blue(std::uint8_t* pixels, std::size_t count) {
  std::size_t i = 0;
  if (count >= 16) {
    Bytes16 next, x;
    std::memcpy(&next, pixels, sizeof(next));
    // The next ones are read before these are written: what overlaps need not wait.
    for (; i + 31 <= count; i += 15) {
      x = next;
      std::memcpy(&next, pixels + i + 15, sizeof(next));
      swap_in_five(x);
      std::memcpy(pixels + i, &x, sizeof(x));
    }
  }
  for (; i + 3 <= count; i += 3) std::swap(pixels[i], pixels[i + 2]);
}

/// Three bytes per pixel. Whole rows are copied, into memory that nobody has cleared before.
Image three_bytes(const RawPixels& raw, bool blue_first) {
  Image image;
  image.width = static_cast<int>(raw.width);
  image.height = static_cast<int>(raw.height);
  image.channels = 3;
  const std::size_t row = 3 * raw.width;
  image.pixels.reserve(row * raw.height);
  const std::size_t together = raw.step == row ? raw.height : 1;  // rows
  for (std::size_t y = 0; y < raw.height; y += together) image.pixels.insert(image.pixels.end(), raw.row(y), raw.row(y) + row * together);
  if (blue_first) swap_red_and_blue(image.pixels.data(), image.pixels.size());
  return image;
}

Image rgb(const RawPixels& raw) { return three_bytes(raw, false); }
Image bgr(const RawPixels& raw) { return three_bytes(raw, true); }

/// `stride` bytes per pixel, of which those at `red`, `green`, `blue` are the colours.
template <std::size_t stride, std::size_t red, std::size_t green, std::size_t blue>
Image colour(const RawPixels& raw) {
  Image image = blank(raw, 3);
  std::uint8_t* out = image.pixels.data();
  for (std::size_t y = 0; y < raw.height; ++y) {
    const std::uint8_t* in = raw.row(y);
    for (std::size_t x = 0; x < raw.width; ++x, in += stride, out += 3) {
      out[0] = in[red];
      out[1] = in[green];
      out[2] = in[blue];
    }
  }
  return image;
}

/// A mosaic with its red pixel at (red_x, red_y) of each 2x2 block. Each missing colour is the mean of the nearest pixels that have it.
template <std::size_t red_x, std::size_t red_y>
Image bayer(const RawPixels& raw) {
  Image image = blank(raw, 3);
  const auto width = static_cast<std::ptrdiff_t>(raw.width), height = static_cast<std::ptrdiff_t>(raw.height);
  // Mirrored at the border, which keeps the parity and with it the colour (a 1-pixel side has nothing to mirror).
  const auto mirror = [](std::ptrdiff_t i, std::ptrdiff_t size) {
    if (i < 0) i = -i;
    if (i >= size) i = 2 * size - 2 - i;
    return std::clamp<std::ptrdiff_t>(i, 0, size - 1);
  };
  std::uint8_t* out = image.pixels.data();
  for (std::ptrdiff_t y = 0; y < height; ++y) {
    const std::uint8_t* above = raw.row(static_cast<std::size_t>(mirror(y - 1, height)));
    const std::uint8_t* here = raw.row(static_cast<std::size_t>(y));
    const std::uint8_t* below = raw.row(static_cast<std::size_t>(mirror(y + 1, height)));
    const bool red_row = (static_cast<std::size_t>(y) & 1) == red_y;
    for (std::ptrdiff_t x = 0; x < width; ++x, out += 3) {
      const std::ptrdiff_t left = mirror(x - 1, width), right = mirror(x + 1, width);
      const bool red_column = (static_cast<std::size_t>(x) & 1) == red_x;
      const int sides = here[left] + here[right], ends = above[x] + below[x];
      const int corners = above[left] + above[right] + below[left] + below[right];
      if (red_row == red_column) {  // on red or on blue
        const auto opposite = static_cast<std::uint8_t>(corners / 4);
        out[0] = red_row ? here[x] : opposite;
        out[1] = static_cast<std::uint8_t>((sides + ends) / 4);
        out[2] = red_row ? opposite : here[x];
      } else {  // on green
        out[0] = static_cast<std::uint8_t>((red_row ? sides : ends) / 2);
        out[1] = here[x];
        out[2] = static_cast<std::uint8_t>((red_row ? ends : sides) / 2);
      }
    }
  }
  return image;
}

std::uint8_t clamp_to_byte(int value) { return static_cast<std::uint8_t>(std::clamp(value, 0, 255)); }

/// Two pixels in four bytes: brightness at `y0` and y0 + 2, the two colour differences between them. Full-range BT.601, as OpenCV.
template <std::size_t y0>
Image yuv422(const RawPixels& raw) {
  Image image = blank(raw, 3);
  constexpr std::size_t u_at = 1 - y0, v_at = 3 - y0;
  std::uint8_t* out = image.pixels.data();
  for (std::size_t y = 0; y < raw.height; ++y) {
    const std::uint8_t* in = raw.row(y);
    for (std::size_t x = 0; x < raw.width; ++x, out += 3) {
      const std::uint8_t* pair = in + 4 * (x / 2);
      const bool whole = x + 1 < raw.width || x % 2 == 1;  // the last pixel of an odd row has no partner
      const int luma = 298 * (pair[y0 + 2 * (x % 2)] - 16) + 128;
      const int u = whole ? pair[u_at] - 128 : 0, v = whole ? pair[v_at] - 128 : 0;
      out[0] = clamp_to_byte((luma + 409 * v) >> 8);
      out[1] = clamp_to_byte((luma - 100 * u - 208 * v) >> 8);
      out[2] = clamp_to_byte((luma + 516 * u) >> 8);
    }
  }
  return image;
}

}  // namespace

const PixelFormat* find_pixel_format(std::string_view encoding) {
  static constexpr std::array<PixelFormat, 15> formats{{{"mono8", 1, grey8},
                                                        {"8UC1", 1, grey8},
                                                        {"mono16", 2, grey16},
                                                        {"rgb8", 3, rgb},
                                                        {"bgr8", 3, bgr},
                                                        {"8UC3", 3, bgr},
                                                        {"rgba8", 4, colour<4, 0, 1, 2>},
                                                        {"bgra8", 4, colour<4, 2, 1, 0>},
                                                        {"8UC4", 4, colour<4, 2, 1, 0>},
                                                        {"bayer_rggb8", 1, bayer<0, 0>},
                                                        {"bayer_bggr8", 1, bayer<1, 1>},
                                                        {"bayer_gbrg8", 1, bayer<0, 1>},
                                                        {"bayer_grbg8", 1, bayer<1, 0>},
                                                        {"yuv422", 2, yuv422<1>},
                                                        {"yuv422_yuy2", 2, yuv422<0>}}};
  const auto it = std::ranges::find(formats, encoding, &PixelFormat::encoding);
  return it == formats.end() ? nullptr : &*it;
}

}  // namespace kilvo::lab
