#include "kilvo/vision/patch_sums.hpp"

#include <algorithm>

#include "kilvo/math/wide.hpp"

namespace kilvo {
namespace {

// Brighter pixels are taken as saturated.
constexpr float bright = 252;

struct Sums {
  float xx, xy, yy, sx, sy, xr, yr, sr, rr, sum, top;
};

// Over the pixels, in lanes that are added at the end.
KILVO_WIDE Sums sum_up(const Template& patch, const Values& image, float t, float tp) {
  Lanes xx{}, xy{}, yy{}, sx{}, sy{}, xr{}, yr{}, sr{}, rr{}, sum{}, top{};
  for (std::size_t k = 0; k < Template::count; k += lanes) {
    Lanes value, seen, x, y;
    read_lanes(value, &patch.value[k]);
    read_lanes(seen, &image[k]);
    read_lanes(x, &patch.dx[k]);
    read_lanes(y, &patch.dy[k]);
    x *= tp;
    y *= tp;
    const Lanes r = t * seen - tp * value;
    xx += x * x;
    xy += x * y;
    yy += y * y;
    sx += x;
    sy += y;
    xr += x * r;
    yr += y * r;
    sr += r;
    rr += r * r;
    sum += value;
    const Lanes brighter = value > seen ? value : seen;
    top = brighter > top ? brighter : top;
  }
  float most = 0;
  for (std::size_t i = 0; i < lanes; ++i) most = std::max(most, top[i]);
  return {total(xx), total(xy), total(yy), total(sx), total(sy), total(xr), total(yr), total(sr), total(rr), total(sum), most};
}

}  // namespace

PatchSums sums_of(const Template& patch, const Values& image, double tau, double tau_patch, double bias_variance, double variance) {
  const auto t = static_cast<float>(tau), tp = static_cast<float>(tau_patch);
  // The gradient is the patch's, so that it stays the same from iterate to iterate. The exposure is known by the patch's mean alone: by its
  // contrast, noise that is in the patch and in r would make each generation of patches look a little darker than the last.
  const Sums sums = sum_up(patch, image, t, tp);
  const auto& [xx, xy, yy, sx, sy, xr, yr, sr, rr, sum, top] = sums;
  constexpr double n = Template::count;
  PatchSums out;
  out.saturated = top > bright;
  const double i = static_cast<double>(tp / t * sum) / n;
  const Eigen::Vector3d s(static_cast<double>(sx), static_cast<double>(sy), n * i);
  out.A << static_cast<double>(xx), static_cast<double>(xy), i * s[0], static_cast<double>(xy), static_cast<double>(yy), i * s[1], i * s[0],
      i * s[1], n * i * i;
  out.b << static_cast<double>(xr), static_cast<double>(yr), i * static_cast<double>(sr);
  const double pixels = n + variance / bias_variance;
  out.A -= s * s.transpose() / pixels;
  out.b -= s * static_cast<double>(sr) / pixels;
  out.mean_square = (static_cast<double>(rr) - static_cast<double>(sr) * static_cast<double>(sr) / n) / (n - 1);
  return out;
}

float mean_of(const Values& values) {
  Lanes sum{};
  for (std::size_t k = 0; k < Template::count; k += lanes) {
    Lanes v;
    read_lanes(v, &values[k]);
    sum += v;
  }
  return total(sum) / Template::count;
}

}  // namespace kilvo
