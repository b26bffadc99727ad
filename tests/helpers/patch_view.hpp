// Two images of a simulated walk and what a patch of one looks like in the other.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "lab/simulation/simulator.hpp"

namespace kilvo::test {

/// The green channel between the pixels: a windowed sinc of three pixels' reach. A bilinear value would be blurred by up to half of what
/// the lens blurs, and compare the comparison.
inline double grey_at(const Image& image, const Eigen::Vector2d& at) {
  constexpr int reach = 3;
  const auto weight = [](double x) {
    const double a = std::numbers::pi * x;
    return std::abs(x) < 1e-9 ? 1.0 : std::sin(a) / a * std::sin(a / reach) / (a / reach);
  };
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  double sum = 0, weights = 0;
  for (int j = y - reach + 1; j <= y + reach; ++j) {
    const double wy = weight(at.y() - j);
    for (int i = x - reach + 1; i <= x + reach; ++i) {
      const double w = wy * weight(at.x() - i);
      sum += w * image.pixels[3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(i)) + 1];
      weights += w;
    }
  }
  return sum / weights;
}

/// The same through a Gaussian of this covariance (its negative directions as zero), by the nine points of a quadrature.
inline double grey_at(const Image& image, const Eigen::Vector2d& at, const Eigen::Matrix2d& missing) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(missing);
  const Eigen::Matrix2d steps = axes.eigenvectors() * (3 * axes.eigenvalues().cwiseMax(0)).cwiseSqrt().asDiagonal();
  double sum = 0;
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      const double weight = (i == 0 ? 2.0 / 3 : 1.0 / 6) * (j == 0 ? 2.0 / 3 : 1.0 / 6);
      sum += weight * grey_at(image, at + steps * Eigen::Vector2d(i, j));
    }
  }
  return sum;
}

/// Correlation of a patch of the first image with the same points of the world in the second.
struct PatchView {
  const lab::Simulator& simulator;
  const Image &first, &second;
  SE3 T_WC1, T_WC2;

  static constexpr int half = 5;    // pixels: 11 x 11
  static constexpr int margin = 2;  // as far as light of something else could reach

  /// Nothing when it is not the same thing that both see: more than one surface, hidden, overexposed, or too flat in grey.
  std::optional<double> correlation(int u0, int v0) const {
    std::vector<double> a, b;
    std::optional<std::size_t> surface;
    constexpr int reach = half + margin;
    Eigen::Matrix<Eigen::Vector2d, 2 * reach + 1, 2 * reach + 1> there;
    for (int v = -reach; v <= reach; ++v) {
      for (int u = -reach; u <= reach; ++u) {
        const auto x = in_second(u0 + u, v0 + v, surface);
        if (!x) return std::nullopt;
        there(v + reach, u + reach) = *x;
      }
    }
    for (int v = 1; v < 2 * reach; ++v) {
      for (int u = 1; u < 2 * reach; ++u) {
        if (std::max(std::abs(u - reach), std::abs(v - reach)) > half) continue;
        // What is nearer is seen in more detail: each image is blurred by what it is sharper than the other.
        Eigen::Matrix2d J;
        J << (there(v, u + 1) - there(v, u - 1)) / 2, (there(v + 1, u) - there(v - 1, u)) / 2;
        const double variance = std::pow(simulator.config().camera.blur, 2);
        const Eigen::Matrix2d I = Eigen::Matrix2d::Identity(), back = J.inverse();
        a.push_back(grey_at(first, {u0 + u - reach, v0 + v - reach}, variance * (back * back.transpose() - I)));
        b.push_back(grey_at(second, there(v, u), variance * (J * J.transpose() - I)));
      }
    }
    return correlation_of(a, b);
  }

 private:
  static std::optional<double> correlation_of(const std::vector<double>& a, const std::vector<double>& b) {
    const Eigen::Map<const Eigen::ArrayXd> x(a.data(), static_cast<Eigen::Index>(a.size())),
        y(b.data(), static_cast<Eigen::Index>(b.size()));
    const Eigen::ArrayXd dx = x - x.mean(), dy = y - y.mean();
    constexpr double least_contrast = 10;  // grey levels
    if (std::sqrt(dx.square().mean()) < least_contrast) return std::nullopt;
    return (dx * dy).sum() / std::sqrt(dx.square().sum() * dy.square().sum());
  }

  /// Where the second image shows what pixel (u, v) of the first one does. `surface`: what the patch's pixels see, once one is known.
  std::optional<Eigen::Vector2d> in_second(int u, int v, std::optional<std::size_t>& surface) const {
    const lab::CameraModel& m = simulator.config().camera;
    const Eigen::Vector3d direction = T_WC1.R * lab::unproject(m, {u, v});
    const auto hit = simulator.world().cast(T_WC1.p, direction);
    if (!hit || surface.value_or(hit->surface) != hit->surface) return std::nullopt;
    surface = hit->surface;
    const Eigen::Vector3d p_W = T_WC1.p + hit->range * direction, p_C = T_WC2.inverse() * p_W;
    if (p_C.z() < 0.1) return std::nullopt;
    const Eigen::Vector2d x = lab::project(m, p_C);
    if (x.x() < 5 || x.y() < 5 || x.x() > m.width - 7 || x.y() > m.height - 7) return std::nullopt;
    const auto back = simulator.world().cast(T_WC2.p, (p_W - T_WC2.p).normalized());
    if (!back || back->surface != hit->surface) return std::nullopt;
    if (is_white(first, u, v) || is_white(second, static_cast<int>(x.x() + 0.5), static_cast<int>(x.y() + 0.5))) return std::nullopt;
    return x;
  }

  static bool is_white(const Image& image, int u, int v) {
    constexpr int white = 254;
    return image.pixels[3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(u)) + 1] >=
           white;
  }
};

}  // namespace kilvo::test
