#include "lab/doctor/feature_tracks.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace kilvo::lab {
namespace {

constexpr int levels = 5;
constexpr int half = 5;         // px, of the window that is compared
constexpr int cell = 48;        // px: one corner of each cell of the image
constexpr int border = 12;      // px
constexpr double weakest = 60;  // smaller eigenvalue of the mean gradient product, (grey levels / px)^2
constexpr int iterations = 12;
constexpr float alike = 12;       // grey levels, mean difference after the fit
constexpr float returned = 0.6F;  // px, from forth and back

float smaller_eigenvalue(const GreyImage& image, int x, int y) {
  float xx = 0, xy = 0, yy = 0;
  for (int v = -3; v <= 3; ++v) {
    const std::uint8_t *row = image.row(y + v), *above = image.row(y + v - 1), *below = image.row(y + v + 1);
    for (int u = -3; u <= 3; ++u) {
      const float gx = 0.5F * static_cast<float>(row[x + u + 1] - row[x + u - 1]);
      const float gy = 0.5F * static_cast<float>(below[x + u] - above[x + u]);
      xx += gx * gx, xy += gx * gy, yy += gy * gy;
    }
  }
  const float mean = 0.5F * (xx + yy), root = std::sqrt(0.25F * (xx - yy) * (xx - yy) + xy * xy);
  return (mean - root) / 49;
}

std::vector<Eigen::Vector2f> corners_of(const GreyImage& image) {
  std::vector<Eigen::Vector2f> out;
  for (int y0 = border; y0 + cell <= image.height - border; y0 += cell) {
    for (int x0 = border; x0 + cell <= image.width - border; x0 += cell) {
      float best = weakest;
      Eigen::Vector2f corner(-1, -1);
      for (int y = y0; y < y0 + cell; y += 4) {
        for (int x = x0; x < x0 + cell; x += 4) {
          const float score = smaller_eigenvalue(image, x, y);
          if (score <= best) continue;
          best = score;
          corner = {static_cast<float>(x), static_cast<float>(y)};
        }
      }
      if (corner.x() >= 0) out.push_back(corner);
    }
  }
  return out;
}

bool inside(const GreyImage& image, const Eigen::Vector2f& p) {
  constexpr float margin = half + 2;
  return p.x() > margin && p.y() > margin && p.x() < static_cast<float>(image.width) - margin - 1 &&
         p.y() < static_cast<float>(image.height) - margin - 1;
}

float value(const GreyImage& image, float x, float y) { return sample(image.pixels.data(), image.width, x, y); }

/// Lucas and Kanade (1981) on one level, with the windows' means removed. `to` is improved; false where it is lost.
bool follow_on_level(const GreyImage& a, const GreyImage& b, const Eigen::Vector2f& from, Eigen::Vector2f& to, float* difference) {
  constexpr int side = 2 * half + 1, count = side * side;
  float patch[count], gx[count], gy[count];
  if (!inside(a, from)) return false;
  Eigen::Matrix2f H = Eigen::Matrix2f::Zero();
  float mean_a = 0;
  for (int i = 0; i < count; ++i) {
    const float x = from.x() + static_cast<float>(i % side - half), y = from.y() + static_cast<float>(i / side - half);
    patch[i] = value(a, x, y);
    gx[i] = 0.5F * (value(a, x + 1, y) - value(a, x - 1, y));
    gy[i] = 0.5F * (value(a, x, y + 1) - value(a, x, y - 1));
    mean_a += patch[i];
    H(0, 0) += gx[i] * gx[i], H(0, 1) += gx[i] * gy[i], H(1, 1) += gy[i] * gy[i];
  }
  H(1, 0) = H(0, 1);
  mean_a /= count;
  if (H.determinant() < 1) return false;
  const Eigen::Matrix2f inverse = H.inverse();
  for (int k = 0; k < iterations; ++k) {
    if (!inside(b, to)) return false;
    float now[count], mean_b = 0;
    for (int i = 0; i < count; ++i) {
      now[i] = value(b, to.x() + static_cast<float>(i % side - half), to.y() + static_cast<float>(i / side - half));
      mean_b += now[i];
    }
    mean_b /= count;
    Eigen::Vector2f g = Eigen::Vector2f::Zero();
    float sum = 0;
    for (int i = 0; i < count; ++i) {
      const float e = (patch[i] - mean_a) - (now[i] - mean_b);
      g += e * Eigen::Vector2f(gx[i], gy[i]);
      sum += std::abs(e);
    }
    *difference = sum / count;
    const Eigen::Vector2f step = inverse * g;
    to += step;
    if (step.squaredNorm() < 1e-4F) break;
  }
  return inside(b, to);
}

std::optional<Eigen::Vector2f> follow(const std::vector<GreyImage>& a, const std::vector<GreyImage>& b, const Eigen::Vector2f& from,
                                      const Eigen::Vector2f& guess) {
  Eigen::Vector2f to = guess;
  float difference = 0;
  const int top = static_cast<int>(std::min(a.size(), b.size())) - 1;
  for (int level = top; level >= 0; --level) {
    const Eigen::Vector2f from_l = at_level(from.cast<double>(), level).cast<float>();
    Eigen::Vector2f to_l = at_level(to.cast<double>(), level).cast<float>();
    const bool found = follow_on_level(a[static_cast<std::size_t>(level)], b[static_cast<std::size_t>(level)], from_l, to_l, &difference);
    if (!found && level == 0) return std::nullopt;
    // On a coarse level the window may reach over the border: the finer ones may still find it.
    if (found) to = ((to_l.array() + 0.5F) * static_cast<float>(1 << level) - 0.5F).matrix();
  }
  if (difference > alike) return std::nullopt;
  return to;
}

}  // namespace

std::optional<TrackedPair> FeatureTracker::push(double t, const Image& image) {
  std::vector<GreyImage> now = pyramid_of(to_grey(image), levels);
  std::optional<TrackedPair> out;
  if (!last_.empty() && last_.front().width == now.front().width && last_.front().height == now.front().height && t > last_t_) {
    out.emplace();
    out->from = last_t_;
    out->to = t;
    for (const Eigen::Vector2f& corner : corners_of(last_.front())) {
      const auto there = follow(last_, now, corner, corner);
      if (!there) continue;
      const auto back = follow(now, last_, *there, corner);
      if (back && (*back - corner).norm() < returned) out->tracks.push_back({corner, *there});
    }
  }
  last_ = std::move(now);
  last_t_ = t;
  return out;
}

}  // namespace kilvo::lab
