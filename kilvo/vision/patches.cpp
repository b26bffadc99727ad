#include "kilvo/vision/patches.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/math/wide.hpp"

namespace kilvo {
namespace {

// By how much a pixel of the view may be larger or smaller than one of the level it is taken from.
constexpr double largest_scale = 1.5, smallest_scale = 0.55;

constexpr float half = (Template::size - 1) / 2.0F;

struct Corner {
  int x, y;                // upper left pixel of a patch in its level
  Eigen::Vector2d centre;  // of the point within the patch
};

Corner corner_at(const Eigen::Vector2d& pixel, int level) {
  const Eigen::Vector2d c = at_level(pixel, level);
  const int x = static_cast<int>(std::floor(c.x())) - Patch::before, y = static_cast<int>(std::floor(c.y())) - Patch::before;
  return {x, y, {c.x() - x, c.y() - y}};
}

// The pixels of a template with one more on each side, for the gradient.
constexpr int wide = Template::size + 2;
constexpr std::size_t wide_count = (wide * wide + lanes - 1) / lanes * lanes;
using Wide = std::array<float, wide_count>;

// A template's pixel (x, y) lies at centre + (x step_x + y step_y) / (1 + c'(x, y)) of a patch.
struct Placing {
  float centre[2], step_x[2], step_y[2], c[2];
};

// Bilinear, of each pixel. The places first, then their four neighbours (not for many at once), then what is between them.
KILVO_WIDE void sample_all(const std::uint8_t* pixels, const Placing& placing, Wide& out) {
  constexpr float reach = half + 1;
  alignas(32) std::array<float, wide_count> a, b;
  alignas(32) std::array<std::int32_t, wide_count> corner;
  alignas(32) std::array<std::uint8_t, wide_count> upper0, upper1, lower0, lower1;
  alignas(32) std::array<float, wide_count> xs, ys;
  for (int k = 0; k < static_cast<int>(wide_count); ++k) {
    const int clamped = std::min(k, wide * wide - 1);
    xs[static_cast<std::size_t>(k)] = static_cast<float>(clamped % wide) - reach;
    ys[static_cast<std::size_t>(k)] = static_cast<float>(clamped / wide) - reach;
  }
  for (std::size_t k = 0; k < wide_count; ++k) {
    const float x = xs[k], y = ys[k], depth = 1 + placing.c[0] * x + placing.c[1] * y;
    const float u = placing.centre[0] + (x * placing.step_x[0] + y * placing.step_y[0]) / depth;
    const float v = placing.centre[1] + (x * placing.step_x[1] + y * placing.step_y[1]) / depth;
    const auto iu = static_cast<std::int32_t>(u), iv = static_cast<std::int32_t>(v);
    a[k] = u - static_cast<float>(iu);
    b[k] = v - static_cast<float>(iv);
    corner[k] = iv * Patch::size + iu;
  }
  for (std::size_t k = 0; k < wide_count; ++k) {
    const std::uint8_t* const at = pixels + corner[k];
    upper0[k] = at[0];
    upper1[k] = at[1];
    lower0[k] = at[Patch::size];
    lower1[k] = at[Patch::size + 1];
  }
  for (std::size_t k = 0; k < wide_count; ++k) {
    const float top = static_cast<float>(upper0[k]) + a[k] * static_cast<float>(upper1[k] - upper0[k]);
    const float bottom = static_cast<float>(lower0[k]) + a[k] * static_cast<float>(lower1[k] - lower0[k]);
    out[k] = top + b[k] * (bottom - top);
  }
}

}  // namespace

std::optional<Patch> cut_patch(std::span<const GreyImage> pyramid, const Eigen::Vector2d& pixel) {
  Patch patch;
  patch.levels_cut = 0;
  for (int level = 0; level < Patch::levels && level < static_cast<int>(pyramid.size()); ++level) {
    const GreyImage& image = pyramid[static_cast<std::size_t>(level)];
    const Corner corner = corner_at(pixel, level);
    if (corner.x < 0 || corner.y < 0 || corner.x + Patch::size > image.width || corner.y + Patch::size > image.height) break;
    for (int y = 0; y < Patch::size; ++y) {
      std::copy_n(image.row(corner.y + y) + corner.x, Patch::size, patch.pixels[static_cast<std::size_t>(level)].begin() + y * Patch::size);
    }
    ++patch.levels_cut;
  }
  if (patch.levels_cut == 0) return std::nullopt;
  return patch;
}

KILVO_WIDE float corner_of(const GreyImage& image, int x, int y) {
  constexpr int reach = 4;
  if (x < reach + 1 || y < reach + 1 || x + reach + 1 >= image.width || y + reach + 1 >= image.height) return 0;
  int xx = 0, xy = 0, yy = 0;
  for (int j = y - reach; j < y + reach; ++j) {
    const std::uint8_t *above = image.row(j - 1) + x - reach, *here = image.row(j) + x - reach, *below = image.row(j + 1) + x - reach;
    for (int i = 0; i < 2 * reach; ++i) {
      const int dx = here[i + 1] - here[i - 1], dy = below[i] - above[i];
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
  const auto a = static_cast<float>(xx), b = static_cast<float>(xy), c = static_cast<float>(yy);
  // Of differences over two pixels.
  return (0.5F * (a + c) - std::sqrt(0.25F * (a - c) * (a - c) + b * b)) / (4.0F * 4 * reach * reach);
}

std::optional<Template> warp(const Observation& from, const PlaneWarp& plane, int level) {
  const double scale = std::sqrt(std::abs(plane.A.determinant())) * (1 << level);  // pixels of level 0 of the patch by a pixel of the view
  const int source = std::clamp(static_cast<int>(std::lround(std::log2(std::max(scale, 1e-3)))), 0, from.patch.levels_cut - 1);
  const double relative = scale / (1 << source);
  if (!(relative < largest_scale && relative > smallest_scale)) return std::nullopt;
  const Eigen::Vector2f centre = corner_at(from.pixel.cast<double>(), source).centre.cast<float>();
  const Eigen::Matrix2f step = (plane.A * (static_cast<double>(1 << level) / (1 << source))).cast<float>();
  const Eigen::Vector2f c = (plane.c * (1 << level)).cast<float>();
  const float reach = half + 1;
  constexpr float most = 0.3F;
  const float nearest = 1 - reach * (std::abs(c.x()) + std::abs(c.y()));
  if (nearest < most) return std::nullopt;
  const Eigen::Vector2f extent = reach / nearest * (step.col(0).cwiseAbs() + step.col(1).cwiseAbs());
  if (((centre - extent).array() < 0).any() || ((centre + extent).array() > Patch::size - 1.001F).any()) return std::nullopt;
  const auto& pixels = from.patch.pixels[static_cast<std::size_t>(source)];
  alignas(32) Wide values;
  sample_all(pixels.data(), {{centre.x(), centre.y()}, {step(0, 0), step(1, 0)}, {step(0, 1), step(1, 1)}, {c.x(), c.y()}}, values);
  Template out;
  for (int j = 0; j < Template::size; ++j) {
    for (int i = 0; i < Template::size; ++i) {
      const auto k = static_cast<std::size_t>(j * Template::size + i);
      const auto* at = values.data() + (j + 1) * wide + i + 1;
      out.value[k] = at[0];
      out.dx[k] = 0.5F * (at[1] - at[-1]);
      out.dy[k] = 0.5F * (at[wide] - at[-wide]);
    }
  }
  return out;
}

KILVO_WIDE void sample_patch(const GreyImage& image, const Eigen::Vector2f& centre, std::array<float, Template::count>& out) {
  const float x0 = centre.x() - half, y0 = centre.y() - half;
  const int ix = static_cast<int>(x0), iy = static_cast<int>(y0);
  const float a = x0 - static_cast<float>(ix), b = y0 - static_cast<float>(iy);
  const float w00 = (1 - a) * (1 - b), w10 = a * (1 - b), w01 = (1 - a) * b, w11 = a * b;
  for (int j = 0; j < Template::size; ++j) {
    const std::uint8_t* upper = image.row(iy + j) + ix;
    const std::uint8_t* lower = upper + image.width;
    float* row = out.data() + j * Template::size;
    for (int i = 0; i < Template::size; ++i) {
      row[i] = w00 * static_cast<float>(upper[i]) + w10 * static_cast<float>(upper[i + 1]) + w01 * static_cast<float>(lower[i]) +
               w11 * static_cast<float>(lower[i + 1]);
    }
  }
}

KILVO_WIDE float correlation(const std::array<float, Template::count>& a, const std::array<float, Template::count>& b) {
  Lanes sum_a{}, sum_b{}, sum_aa{}, sum_ab{}, sum_bb{};
  for (std::size_t k = 0; k < Template::count; k += lanes) {
    Lanes x, y;
    read_lanes(x, &a[k]);
    read_lanes(y, &b[k]);
    sum_a += x;
    sum_b += y;
    sum_aa += x * x;
    sum_ab += x * y;
    sum_bb += y * y;
  }
  const float sa = total(sum_a), sb = total(sum_b), saa = total(sum_aa), sab = total(sum_ab), sbb = total(sum_bb);
  constexpr float n = Template::count;
  const float va = saa - sa * sa / n, vb = sbb - sb * sb / n;
  constexpr float flat = 1e-3F;
  return va > flat && vb > flat ? (sab - sa * sb / n) / std::sqrt(va * vb) : 0;
}

}  // namespace kilvo
