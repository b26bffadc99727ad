#include "kilvo/lidar/undistort.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

using Affine = Eigen::Matrix4f;  // whole columns, of which the processor takes four numbers at once

// Poses every millisecond; between them the matrix is interpolated, which at 10 rad/s is wrong by 1e-5 rad at most.
constexpr std::int64_t step_ns = 1'000'000;

Affine to_affine(const SE3& T) {
  Affine A = Affine::Zero();
  A.topLeftCorner<3, 3>() = T.R.matrix().cast<float>();
  A.topRightCorner<3, 1>() = T.p.cast<float>();
  return A;
}

// T_I(at),L(t) on a grid of times from `first` on.
std::vector<Affine> relative_poses(const Trajectory& trajectory, const SE3& T_IW, const SE3& T_IL, Time first, std::size_t count) {
  std::vector<Affine> poses(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Time t = std::clamp(first + Duration(static_cast<std::int64_t>(i) * step_ns), trajectory.oldest(), trajectory.newest());
    poses[i] = to_affine(T_IW * *trajectory.at(t) * T_IL);
  }
  return poses;
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
  Time scan_first = last, scan_last = first;
  for (const LidarPoint& p : scan.points) {
    const Time t = scan.t + Duration(p.offset_ns);
    if (t < first || t > last) continue;
    scan_first = std::min(scan_first, t);
    scan_last = std::max(scan_last, t);
  }
  if (last < first || scan_last < scan_first) {
    drops.outside_trajectory += static_cast<std::uint32_t>(scan.points.size());
    return out;
  }
  const auto count = static_cast<std::size_t>((scan_last - scan_first).count() / step_ns) + 2;
  const std::vector<Affine> poses = relative_poses(trajectory, T_WI->inverse(), mount.T_imu_lidar, scan_first, count);

  const auto min2 = static_cast<float>(mount.min_range * mount.min_range), max2 = static_cast<float>(mount.max_range * mount.max_range);
  const std::int64_t base = (scan.t - scan_first).count();
  const std::int64_t span = (scan_last - scan_first).count();
  constexpr float inverse_step = 1.0f / static_cast<float>(step_ns);
  out.reserve(scan.points.size());
  for (const LidarPoint& p : scan.points) {
    const float range2 = p.x * p.x + p.y * p.y + p.z * p.z;
    if (!std::isfinite(range2)) {
      ++drops.non_finite;
      continue;
    }
    if (range2 < min2 || range2 > max2) {
      ++(range2 == 0 ? drops.at_origin : range2 < min2 ? drops.too_near : drops.too_far);
      continue;
    }
    const std::int64_t offset = base + p.offset_ns;
    if (offset < 0 || offset > span) {
      ++drops.outside_trajectory;
      continue;
    }
    const std::int64_t i = offset / step_ns;
    const float s = static_cast<float>(offset - i * step_ns) * inverse_step;
    const Affine& A = poses[static_cast<std::size_t>(i)];
    const Affine& B = poses[static_cast<std::size_t>(i) + 1];
    const Eigen::Vector4f a = A.col(0) * p.x + A.col(1) * p.y + A.col(2) * p.z + A.col(3);
    const Eigen::Vector4f b = B.col(0) * p.x + B.col(1) * p.y + B.col(2) * p.z + B.col(3);
    PointXYZI& x = out.emplace_back(a + s * (b - a));
    x[3] = std::isfinite(p.intensity) ? p.intensity : 0;  // a place is good without it
  }
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
