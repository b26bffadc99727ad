// The clusters of a sweep as groups of points in the world, four at a time.
#include <array>
#include <cstddef>

#include "kilvo/lidar/point_to_plane.hpp"

namespace kilvo {
namespace {

using Double4 = double __attribute__((vector_size(32)));

// By row and column; of four clusters each.
using Vector4 = std::array<Double4, 3>;
using Symmetric4 = std::array<Double4, 6>;  // xx xy xz yy yz zz

constexpr std::array<std::array<std::size_t, 3>, 3> place{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};  // in a Symmetric4

struct Pose4 {
  std::array<std::array<double, 3>, 3> R;
  std::array<double, 3> p, p_IL;
  double along, angle_variance;  // of range_noise and angle_noise
};

[[gnu::always_inline]] inline void rotate(const Pose4& to, const Vector4& x, Vector4& out) {
  for (std::size_t i = 0; i < 3; ++i) out[i] = to.R[i][0] * x[0] + (to.R[i][1] * x[1] + to.R[i][2] * x[2]);
}

// R S R'
[[gnu::always_inline]] inline void rotate(const Pose4& to, const Symmetric4& S, Symmetric4& out) {
  for (std::size_t i = 0; i < 3; ++i) {
    Vector4 T;
    for (std::size_t j = 0; j < 3; ++j) T[j] = to.R[i][0] * S[place[0][j]] + (to.R[i][1] * S[place[1][j]] + to.R[i][2] * S[place[2][j]]);
    for (std::size_t j = i; j < 3; ++j) out[place[i][j]] = T[0] * to.R[j][0] + T[1] * to.R[j][1] + T[2] * to.R[j][2];
  }
}

// Range noise along the beam, bearing noise across it, as in point_noise.hpp.
[[gnu::always_inline]] inline void noise_of(const Pose4& to, const Vector4& beam, Symmetric4& out) {
  const Double4 range2 = beam[0] * beam[0] + (beam[1] * beam[1] + beam[2] * beam[2]);
  const Double4 across = to.angle_variance * range2, more = (to.along - across) / range2;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) out[place[i][j]] = more * beam[i] * beam[j];
    out[place[i][i]] += across;
  }
}

[[gnu::always_inline]] inline void write(const Symmetric4& from, std::size_t lane, Eigen::Matrix3d& to) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = i; j < 3; ++j) to(i, j) = to(j, i) = from[place[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]][lane];
  }
}

constexpr std::size_t at_once = 4;

KILVO_WIDE void move(const PointCluster* from, std::size_t count, const Pose4& pose, PointGroup* to) {
  for (std::size_t first = 0; first < count; first += at_once) {
    const std::size_t n = count - first < at_once ? count - first : at_once;
    Vector4 mean{}, beam;
    Symmetric4 scatter{}, turned, noise;
    for (std::size_t k = 0; k < at_once; ++k) {
      const PointCluster& c = from[first + (k < n ? k : 0)];
      for (std::size_t i = 0; i < 3; ++i) mean[i][k] = static_cast<double>(c.mean[static_cast<Eigen::Index>(i)]);
      for (std::size_t i = 0; i < 6; ++i) scatter[i][k] = static_cast<double>(c.scatter[static_cast<Eigen::Index>(i)]);
    }
    Vector4 beam_I, at;
    for (std::size_t i = 0; i < 3; ++i) beam_I[i] = mean[i] - pose.p_IL[i];
    rotate(pose, beam_I, beam);
    noise_of(pose, beam, noise);
    rotate(pose, scatter, turned);
    rotate(pose, mean, at);
    for (std::size_t k = 0; k < n; ++k) {
      PointGroup& g = to[first + k];
      for (std::size_t i = 0; i < 3; ++i) g.mean[static_cast<Eigen::Index>(i)] = at[i][k] + pose.p[i];
      g.count = static_cast<double>(from[first + k].count);
      write(turned, k, g.scatter);
      write(noise, k, g.noise);
    }
  }
}

}  // namespace

std::vector<PointGroup> to_world(std::span<const PointCluster> clusters, const SE3& T_WI, const Eigen::Vector3d& p_IL,
                                 const LidarConfig& config) {
  std::vector<PointGroup> groups(clusters.size());
  Pose4 pose{{}, {}, {}, config.range_noise * config.range_noise, config.angle_noise * config.angle_noise};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    pose.p[i] = T_WI.p[row];
    pose.p_IL[i] = p_IL[row];
    for (std::size_t j = 0; j < 3; ++j) pose.R[i][j] = T_WI.R.matrix()(row, static_cast<Eigen::Index>(j));
  }
  move(clusters.data(), clusters.size(), pose, groups.data());
  return groups;
}

}  // namespace kilvo
