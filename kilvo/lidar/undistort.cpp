#include "kilvo/lidar/undistort.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace kilvo {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Float8 = float __attribute__((vector_size(32)));

// The columns of two poses that follow each other, side by side: the processor moves a point by both at once.
struct alignas(32) Pair {
  Float8 column[4];
};

// Poses every millisecond; between them the matrix is interpolated, which at 10 rad/s is wrong by 1e-5 rad at most.
constexpr std::int64_t step_ns = 1'000'000;

Eigen::Matrix4f to_columns(const SE3& T) {
  Eigen::Matrix4f A = Eigen::Matrix4f::Zero();
  A.topLeftCorner<3, 3>() = T.R.matrix().cast<float>();
  A.topRightCorner<3, 1>() = T.p.cast<float>();
  return A;
}

// T_I(at),L(t) on a grid of times from `first` on; each with the next.
std::vector<Pair> relative_poses(const Trajectory& trajectory, const SE3& T_IW, const SE3& T_IL, Time first, std::size_t count) {
  std::vector<Pair> pairs(count);
  for (std::size_t i = 0; i <= count; ++i) {
    const Time t = std::clamp(first + Duration(static_cast<std::int64_t>(i) * step_ns), trajectory.oldest(), trajectory.newest());
    const Eigen::Matrix4f pose = to_columns(T_IW * *trajectory.at(t) * T_IL);
    for (int column = 0; column < 4; ++column) {
      float* const here = i < count ? reinterpret_cast<float*>(&pairs[i].column[column]) : nullptr;
      if (here != nullptr) std::copy_n(pose.col(column).data(), 4, here);
      if (i > 0) std::copy_n(pose.col(column).data(), 4, reinterpret_cast<float*>(&pairs[i - 1].column[column]) + 4);
    }
  }
  return pairs;
}

// What a point must satisfy.
struct Limits {
  float nearest2, farthest2;  // m^2
  std::int64_t base, span;    // ns: of a scan's time on the grid, and how long the grid is
};

void count_drop(const LidarPoint& p, const Limits& limits, PointDrops& drops) {
  const float range2 = p.x * p.x + p.y * p.y + p.z * p.z;
  if (!std::isfinite(range2)) {
    ++drops.non_finite;
  } else if (range2 < limits.nearest2 || range2 > limits.farthest2) {
    ++(range2 == 0 ? drops.at_origin : range2 < limits.nearest2 ? drops.too_near : drops.too_far);
  } else {
    ++drops.outside_trajectory;
  }
}

// Writes the points that can be used; how many.
KILVO_WIDE std::size_t move_points(std::span<const LidarPoint> points, const Pair* pairs, const Limits& limits, PointDrops& drops,
                                   PointXYZI* out) {
  constexpr float inverse_step = 1.0f / static_cast<float>(step_ns);
  std::size_t used = 0;
  for (const LidarPoint& p : points) {
    const float range2 = p.x * p.x + p.y * p.y + p.z * p.z;
    const std::int64_t offset = limits.base + p.offset_ns;
    if (!(range2 >= limits.nearest2 && range2 <= limits.farthest2) || offset < 0 || offset > limits.span) [[unlikely]] {
      count_drop(p, limits, drops);
      continue;
    }
    const std::int64_t i = offset / step_ns;
    const float s = static_cast<float>(offset - i * step_ns) * inverse_step;
    const Pair& pair = pairs[i];
    const Float8 both = pair.column[0] * p.x + pair.column[1] * p.y + pair.column[2] * p.z + pair.column[3];
    const Float4 a{both[0], both[1], both[2], both[3]}, b{both[4], both[5], both[6], both[7]};
    Float4 x = a + s * (b - a);
    x[3] = p.intensity - p.intensity == 0 ? p.intensity : 0;  // a place is good without it
    std::memcpy(out[used++].data(), &x, sizeof(x));
  }
  return used;
}

// A point may lie this far outside the trajectory (the last points of a scan, a first scan cut by the start) and take its end pose.
constexpr Duration slack = std::chrono::milliseconds(5);

}  // namespace

std::vector<PointXYZI> undistort(const LidarScan& scan, const Trajectory& trajectory, Time at, const LidarMount& mount, PointDrops& drops) {
  std::vector<PointXYZI> out;
  const auto T_WI = trajectory.at(at);
  if (!T_WI) {
    drops.outside_trajectory += static_cast<std::uint32_t>(scan.points.size());
    return out;
  }
  // Offsets on the grid that starts at the oldest usable time.
  const Time first = std::max(trajectory.oldest() - slack, scan.t - std::chrono::seconds(3));
  const Time last = std::min(trajectory.newest() + slack, scan.t + std::chrono::seconds(3));
  const std::int64_t lowest = (first - scan.t).count(), highest = (last - scan.t).count();
  std::int64_t earliest = highest, latest = lowest;
  for (const LidarPoint& p : scan.points) {
    const bool within = p.offset_ns >= lowest && p.offset_ns <= highest;
    earliest = within && p.offset_ns < earliest ? p.offset_ns : earliest;
    latest = within && p.offset_ns > latest ? p.offset_ns : latest;
  }
  if (highest < lowest || latest < earliest) {
    drops.outside_trajectory += static_cast<std::uint32_t>(scan.points.size());
    return out;
  }
  const auto count = static_cast<std::size_t>((latest - earliest) / step_ns) + 1;
  const std::vector<Pair> pairs = relative_poses(trajectory, T_WI->inverse(), mount.T_imu_lidar, scan.t + Duration(earliest), count);
  const Limits limits{static_cast<float>(mount.min_range * mount.min_range), static_cast<float>(mount.max_range * mount.max_range),
                      -earliest, latest - earliest};
  out.resize(scan.points.size());
  out.resize(move_points(scan.points, pairs.data(), limits, drops, out.data()));
  return out;
}

UndistortionNoise undistortion_noise(const ProcessNoise& noise, Duration half_scan) {
  // A point at the time t from the middle carries |t| of a random walk. The mean over a scan of 2 T, each half by itself, has T / 6 of it
  // when all points tell the same, up to T / 4.5 when they tell it twice in a turn (walls ahead and behind). With the walk over a whole
  // half it has T / 4 in common: the mean of |t|, halved.
  constexpr double own = 0.2, common = 0.25;
  Eigen::Matrix<double, 6, 1> density;
  density.head<3>().setConstant(noise.gyro * noise.gyro);
  density.tail<3>().setConstant(noise.velocity * noise.velocity);
  const double T = to_seconds(half_scan);
  UndistortionNoise out;
  out.V.diagonal() = own * T * density;
  out.with_prediction.diagonal() = -common * T * density;
  return out;
}

}  // namespace kilvo
