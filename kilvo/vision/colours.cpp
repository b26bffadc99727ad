#include "kilvo/vision/colours.hpp"

#include <algorithm>

namespace kilvo {
namespace {

constexpr double nearest = 0.5;   // m; closer is no better
constexpr int overexposed = 250;  // of a channel: how bright it really was, nobody knows
constexpr float of_overexposed = 0.02F;

// By grey value.
std::array<std::uint8_t, 256> exposed(double tau) {
  std::array<std::uint8_t, 256> out;
  for (std::size_t value = 0; value < out.size(); ++value)
    out[value] = static_cast<std::uint8_t>(std::clamp(static_cast<double>(value) * tau, 0.0, 255.0) + 0.5);
  return out;
}

}  // namespace

std::vector<ColouredPoint> colours_of(const Image& image, double tau, const Camera& camera, const SE3& T_CW, const DepthView& view) {
  std::vector<ColouredPoint> out;
  out.reserve(view.seen().size());
  const std::array<std::uint8_t, 256> as_first = exposed(tau);
  const auto channels = static_cast<std::size_t>(image.channels), width = static_cast<std::size_t>(image.width);
  for (const DepthView::Seen& seen : view.seen()) {
    if (!view.shows(seen)) continue;
    const Eigen::Vector3d p_W = view.point(seen), p_C = T_CW * p_W;
    const auto pixel = camera.project(p_C);
    if (!pixel || !camera.sees(*pixel, 0)) continue;
    const auto u = static_cast<std::size_t>(pixel->x() + 0.5), v = static_cast<std::size_t>(pixel->y() + 0.5);
    const std::uint8_t* value = image.pixels.data() + channels * (v * width + u);
    ColouredPoint& point = out.emplace_back();
    point.p_W = p_W.cast<float>();
    for (std::size_t i = 0; i < 3; ++i) point.rgb[i] = as_first[value[channels == 3 ? i : 0]];
    const double depth = std::max(p_C.z(), nearest);
    point.weight = static_cast<float>(1 / (depth * depth));  // as the share of the image that it takes
    if (*std::max_element(value, value + channels) >= overexposed) point.weight *= of_overexposed;
  }
  return out;
}

}  // namespace kilvo
