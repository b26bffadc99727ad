#include "kilvo/vision/patch_sums.hpp"

#include <algorithm>

#include "kilvo/math/wide.hpp"

namespace kilvo {
namespace {

// Between pixels of which one is saturated the values are too low.
constexpr float bright = 245;
// What is to be as bright as this is not looked at: if it were refused for being found too bright, those found too dark would remain.
constexpr float expected_bright = 235;
constexpr float seen_bright = 252;  // whatever was expected: it shows nothing more

struct Sums {
  float xx, xy, yy, sx, sy, xr, yr, sr, rr, sum, top, top_seen;
};

// Over the pixels, in lanes that are added at the end.
KILVO_WIDE Sums sum_up(const Template& patch, const Values& image, float t, float tp) {
  Lanes xx{}, xy{}, yy{}, sx{}, sy{}, xr{}, yr{}, sr{}, rr{}, sum{}, top{}, top_seen{};
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
    top = value > top ? value : top;
    top_seen = seen > top_seen ? seen : top_seen;
  }
  float most = 0, most_seen = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    most = std::max(most, top[i]);
    most_seen = std::max(most_seen, top_seen[i]);
  }
  return {total(xx), total(xy), total(yy), total(sx), total(sy), total(xr), total(yr), total(sr), total(rr), total(sum), most, most_seen};
}

}  // namespace

PatchSums sums_of(const Template& patch, const Values& image, double tau, double tau_patch) {
  const auto t = static_cast<float>(tau), tp = static_cast<float>(tau_patch);
  // The gradient is the patch's, so that it stays the same from iterate to iterate. The exposure is known by the patch's mean alone: by its
  // contrast, noise that is in the patch and in r would make each generation of patches look a little darker than the last.
  const auto [xx, xy, yy, sx, sy, xr, yr, sr, rr, sum, top, top_seen] = sum_up(patch, image, t, tp);
  constexpr double n = Template::count;
  PatchSums out;
  out.saturated = top > bright || top * tp / t > expected_bright || top_seen > seen_bright;
  const double i = static_cast<double>(tp / t * sum) / n;
  out.h = {static_cast<double>(sx), static_cast<double>(sy), n * i};
  out.r = static_cast<double>(sr);
  out.A << static_cast<double>(xx), static_cast<double>(xy), i * out.h[0], static_cast<double>(xy), static_cast<double>(yy), i * out.h[1],
      i * out.h[0], i * out.h[1], n * i * i;
  out.b << static_cast<double>(xr), static_cast<double>(yr), i * out.r;
  out.mean_square = (static_cast<double>(rr) - out.r * out.r / n) / (n - 1);
  return out;
}

void PatchSums::allow(double bias_variance, double variance) {
  const double pixels = Template::count + variance / bias_variance;
  A -= h * h.transpose() / pixels;
  b -= h * r / pixels;
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

float top_of(const Values& values) { return *std::ranges::max_element(values); }

bool is_saturated(float top, double expected) { return top > bright || expected > double{expected_bright}; }

}  // namespace kilvo
