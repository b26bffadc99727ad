#include "kilvo/vision/pyramid.hpp"

#include <algorithm>
#include <utility>

namespace kilvo {
namespace {

constexpr int smallest_side = 16;  // px

/// Grey from colours, 0.299 0.587 0.114.
KILVO_WIDE void mix(const std::uint8_t* __restrict in, std::uint8_t* __restrict grey, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto sum = static_cast<std::uint16_t>(77U * in[3 * i] + 150U * in[3 * i + 1] + 29U * in[3 * i + 2] + 128U);
    grey[i] = static_cast<std::uint8_t>(sum >> 8);
  }
}

/// A row between four, of weights 1 3 3 1: up to 8 * 255.
KILVO_WIDE void blend_rows(const std::uint8_t* __restrict a, const std::uint8_t* __restrict b, const std::uint8_t* __restrict c,
                           const std::uint8_t* __restrict d, std::uint16_t* __restrict out, int width) {
  for (int x = 0; x < width; ++x) out[x] = static_cast<std::uint16_t>(a[x] + d[x] + 3 * (b[x] + c[x]));
}

/// Every second column between four, of weights 1 3 3 1 and rounded; `in` begins one pixel before the row.
KILVO_WIDE void blend_columns(const std::uint16_t* __restrict in, std::uint8_t* __restrict out, int half_width) {
  for (int x = 0; x < half_width; ++x) {
    const auto sum = static_cast<std::uint16_t>(in[2 * x] + in[2 * x + 3] + 3 * (in[2 * x + 1] + in[2 * x + 2]) + 32);
    out[x] = static_cast<std::uint8_t>(sum >> 6);
  }
}

}  // namespace

GreyImage to_grey(const Image& image) {
  if (image.channels != 3) return {image.width, image.height, image.pixels};
  GreyImage out{image.width, image.height, std::vector<std::uint8_t>(image.pixels.size() / 3)};
  mix(image.pixels.data(), out.pixels.data(), out.pixels.size());
  return out;
}

GreyImage half_of(const GreyImage& image) {
  const int width = image.width, last = image.height - 1;
  GreyImage out{image.width / 2, image.height / 2, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  std::vector<std::uint16_t> between(static_cast<std::size_t>(width) + 2);  // a row, with its ends repeated
  for (int y = 0; y < out.height; ++y) {
    blend_rows(image.row(std::max(2 * y - 1, 0)), image.row(2 * y), image.row(2 * y + 1), image.row(std::min(2 * y + 2, last)),
               between.data() + 1, width);
    between.front() = between[1];
    between.back() = between[between.size() - 2];
    blend_columns(between.data(), out.pixels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width), out.width);
  }
  return out;
}

std::vector<GreyImage> pyramid_of(GreyImage image, int levels) {
  std::vector<GreyImage> out;
  out.push_back(std::move(image));
  while (static_cast<int>(out.size()) < levels && std::min(out.back().width, out.back().height) / 2 >= smallest_side) {
    out.push_back(half_of(out.back()));
  }
  return out;
}

}  // namespace kilvo
