#include "kilvo/lidar/range_noise.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

// A plane that is fitted to fewer points than these takes most of their scatter.
constexpr float fewest_points = 8;
// Clusters of a sweep that are used; with fewer than the second there is no estimate.
constexpr std::ptrdiff_t most_clusters = 64;
constexpr std::size_t fewest_clusters = 30;
// Beams that graze a surface show the noise of their angle.
constexpr double least_cosine2 = 0.25;
// Sweeps over which it is averaged.
constexpr double memory = 20;

}  // namespace

void RangeNoise::add(std::span<const PointCluster> clusters, const Eigen::Vector3d& p_IL, const LidarConfig& config) {
  const auto is_large = [](const PointCluster& c) { return c.count >= fewest_points; };
  const auto stride = std::max<std::ptrdiff_t>(1, std::ranges::count_if(clusters, is_large) / most_clusters);
  seen_.clear();
  std::ptrdiff_t large = 0;
  for (const PointCluster& c : clusters) {
    if (!is_large(c) || large++ % stride != 0) continue;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eig;
    eig.computeDirect(c.scatter_matrix().cast<double>());
    const Eigen::Vector3d normal = eig.eigenvectors().col(0), beam = c.mean.cast<double>() - p_IL;
    const double range2 = beam.squaredNorm(), along = normal.dot(beam) * normal.dot(beam), cosine2 = along / range2;
    if (!(cosine2 > least_cosine2)) continue;
    // A plane takes three degrees of freedom; the median of chi-square by Wilson and Hilferty (1931).
    const double freedom = static_cast<double>(c.count) - 3, median = freedom * std::pow(1 - 2 / (9 * freedom), 3);
    const double thickness = eig.eigenvalues()[0] / median;
    seen_.push_back((thickness - config.angle_noise * config.angle_noise * (range2 - along)) / cosine2);
  }
  if (seen_.size() < fewest_clusters) return;
  // Clusters on edges, leaves and people are thicker, but fewer.
  const auto middle = seen_.begin() + static_cast<std::ptrdiff_t>(seen_.size() / 2);
  std::ranges::nth_element(seen_, middle);
  weight_ = std::min(weight_ + 1, memory);
  variance_ += (std::max(0.0, *middle) - variance_) / weight_;
}

double RangeNoise::sigma(double described) const { return std::max(described, std::sqrt(variance_)); }

}  // namespace kilvo
