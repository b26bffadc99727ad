// The clusters of a sweep as groups of points in the world, four at a time.
#include <algorithm>

#include "kilvo/lidar/point_to_plane.hpp"

namespace kilvo {
namespace {

using Double4 = double __attribute__((vector_size(32)));

// Of four clusters each; the symmetric one as xx xy xz yy yz zz.
struct Vector4 {
  Double4 at[3];
};
struct Symmetric4 {
  Double4 at[6];
  [[gnu::always_inline]] Double4& operator()(int i, int j) { return at[i + j + (i > 0 && j > 0 ? 1 : 0)]; }
};

[[gnu::always_inline]] inline void rotate(const Eigen::Matrix3d& R, const Vector4& x, Vector4& out) {
  for (int i = 0; i < 3; ++i) out.at[i] = R(i, 0) * x.at[0] + (R(i, 1) * x.at[1] + R(i, 2) * x.at[2]);
}

// R S R'
[[gnu::always_inline]] inline void rotate(const Eigen::Matrix3d& R, Symmetric4& S, Symmetric4& out) {
  for (int i = 0; i < 3; ++i) {
    Double4 T[3];
    for (int j = 0; j < 3; ++j) T[j] = R(i, 0) * S(0, j) + (R(i, 1) * S(1, j) + R(i, 2) * S(2, j));
    for (int j = i; j < 3; ++j) out(i, j) = T[0] * R(j, 0) + T[1] * R(j, 1) + T[2] * R(j, 2);
  }
}

// Range noise along the beam, bearing noise across it, as in lidar_config.hpp.
[[gnu::always_inline]] inline void noise_of(const Vector4& beam, const LidarConfig& config, Symmetric4& out) {
  const Double4* b = beam.at;
  const Double4 range2 = b[0] * b[0] + (b[1] * b[1] + b[2] * b[2]), across = config.angle_noise * config.angle_noise * range2;
  const Double4 more = (config.range_noise * config.range_noise - across) / range2;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) out(i, j) = more * b[i] * b[j];
    out(i, i) += across;
  }
}

KILVO_WIDE void move(std::span<const PointCluster> from, const SE3& T_WI, const Eigen::Vector3d& p_IL, const LidarConfig& config,
                     PointGroup* to) {
  for (; !from.empty(); from = from.subspan(std::min<std::size_t>(4, from.size()))) {
    const int n = static_cast<int>(std::min<std::size_t>(4, from.size()));
    Vector4 mean, at, beam_I, beam;
    Symmetric4 scatter, turned, noise;
    for (int k = 0; k < 4; ++k) {
      const PointCluster& c = from[k < n ? static_cast<std::size_t>(k) : 0];
      for (int i = 0; i < 3; ++i) mean.at[i][k] = static_cast<double>(c.mean[i]);
      for (int i = 0; i < 6; ++i) scatter.at[i][k] = static_cast<double>(c.scatter[i]);
    }
    for (int i = 0; i < 3; ++i) beam_I.at[i] = mean.at[i] - p_IL[i];
    rotate(T_WI.R.matrix(), beam_I, beam);
    noise_of(beam, config, noise);
    rotate(T_WI.R.matrix(), scatter, turned);
    rotate(T_WI.R.matrix(), mean, at);
    for (int k = 0; k < n; ++k, ++to) {
      to->count = static_cast<double>(from[static_cast<std::size_t>(k)].count);
      for (int i = 0; i < 3; ++i) {
        to->mean[i] = at.at[i][k] + T_WI.p[i];
        for (int j = 0; j < 3; ++j) {
          to->scatter(i, j) = turned(i, j)[k];
          to->noise(i, j) = noise(i, j)[k];
        }
      }
    }
  }
}

}  // namespace

std::vector<PointGroup> to_world(std::span<const PointCluster> clusters, const SE3& T_WI, const Eigen::Vector3d& p_IL,
                                 const LidarConfig& config) {
  std::vector<PointGroup> groups(clusters.size());
  move(clusters, T_WI, p_IL, config, groups.data());
  return groups;
}

}  // namespace kilvo
