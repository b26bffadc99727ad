#include "kilvo/vision/colours.hpp"

#include <algorithm>

namespace kilvo {
namespace {

constexpr double nearest = 0.5;  // m; closer is no better
constexpr float of_overexposed = 0.02F;

// By grey value.
std::array<std::uint8_t, 256> exposed(double tau) {
  std::array<std::uint8_t, 256> out;
  for (std::size_t value = 0; value < out.size(); ++value)
    out[value] = static_cast<std::uint8_t>(std::clamp(static_cast<double>(value) * tau, 0.0, 255.0) + 0.5);
  return out;
}

using Rgb = std::array<std::uint8_t, 3>;

Rgb rgb_of(int y, int blue, int red) {
  const auto byte = [](double x) { return static_cast<std::uint8_t>(std::clamp(x, 0.0, 255.0) + 0.5); };
  return {byte(y + 1.402 * red), byte(y - 0.344136 * blue - 0.714136 * red), byte(y + 1.772 * blue)};
}

Rgb rgb_at(const Image& image, int u, int v) {
  const auto at = static_cast<std::size_t>(v * image.width + u);
  const std::uint8_t* value = image.pixels.data() + static_cast<std::size_t>(image.channels) * at;
  if (image.channels == 3) return {value[0], value[1], value[2]};
  const auto plane = static_cast<std::size_t>(image.chroma_width * image.chroma_height);
  if (plane == 0 || image.chroma.size() != 2 * plane) return {*value, *value, *value};
  const int x = u * image.chroma_width / image.width, y = v * image.chroma_height / image.height;
  const std::uint8_t* chroma = image.chroma.data() + y * image.chroma_width + x;
  constexpr int none = 128;
  return rgb_of(*value, chroma[0] - none, chroma[plane] - none);
}

}  // namespace

std::vector<ColouredPoint> colours_of(const Image& image, double tau, const Camera& camera, const SE3& T_CW, const DepthView& view) {
  std::vector<ColouredPoint> out;
  out.reserve(view.seen().size());
  const std::array<std::uint8_t, 256> as_first = exposed(tau);
  for (const DepthView::Seen& seen : view.seen()) {
    if (!view.shows(seen)) continue;
    const Eigen::Vector3d p_W = view.point(seen), p_C = T_CW * p_W;
    const auto pixel = camera.project(p_C);
    if (!pixel || !camera.sees(*pixel, 0)) continue;
    const Rgb rgb = rgb_at(image, static_cast<int>(pixel->x() + 0.5), static_cast<int>(pixel->y() + 0.5));
    ColouredPoint& point = out.emplace_back();
    point.p_W = p_W.cast<float>();
    for (std::size_t i = 0; i < 3; ++i) point.rgb[i] = as_first[rgb[i]];
    const double depth = std::max(p_C.z(), nearest);
    point.weight = static_cast<float>(1 / (depth * depth));  // as the share of the image that it takes
    if (*std::ranges::max_element(rgb) >= overexposed) point.weight *= of_overexposed;
  }
  return out;
}

}  // namespace kilvo
