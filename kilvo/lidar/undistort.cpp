#include "kilvo/lidar/undistort.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace kilvo {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));
using Long2 = std::int64_t __attribute__((vector_size(16)));
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
  float beyond_body2;         // m^2: nearer points are looked at one by one
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

// A time within a step of the grid, from its beginning on.
struct Step {
  std::int64_t begin = 0, end = 0;  // ns, in offsets of the scan
  const Pair* pair = nullptr;
};

Step step_of(std::int64_t offset_ns, const Pair* pairs, const Limits& limits) {
  const std::int64_t i = (limits.base + offset_ns) / step_ns, begin = i * step_ns - limits.base;
  return {begin, std::min(begin + step_ns, limits.span - limits.base + 1), pairs + i};
}

constexpr float inverse_step = 1.0f / static_cast<float>(step_ns);

[[gnu::always_inline]] inline Float4 moved(const LidarPoint& p, const Step& step) {
  const float s = static_cast<float>(p.offset_ns - step.begin) * inverse_step;
  const Pair& pair = *step.pair;
  const Float8 both = pair.column[0] * p.x + pair.column[1] * p.y + pair.column[2] * p.z + pair.column[3];
  const Float4 a{both[0], both[1], both[2], both[3]}, b{both[4], both[5], both[6], both[7]};
  Float4 x = a + s * (b - a);
  x[3] = p.intensity - p.intensity == 0 ? p.intensity : 0;  // a place is good without it
  return x;
}

[[gnu::always_inline]] inline void transpose(Float4* rows) {
  const Float4 a = __builtin_shuffle(rows[0], rows[1], Int4{0, 4, 1, 5}), b = __builtin_shuffle(rows[0], rows[1], Int4{2, 6, 3, 7});
  const Float4 c = __builtin_shuffle(rows[2], rows[3], Int4{0, 4, 1, 5}), d = __builtin_shuffle(rows[2], rows[3], Int4{2, 6, 3, 7});
  rows[0] = __builtin_shuffle(a, c, Int4{0, 1, 4, 5}), rows[1] = __builtin_shuffle(a, c, Int4{2, 3, 6, 7});
  rows[2] = __builtin_shuffle(b, d, Int4{0, 1, 4, 5}), rows[3] = __builtin_shuffle(b, d, Int4{2, 3, 6, 7});
}

[[gnu::always_inline]] inline bool all(const Int4& lanes) {
  Long2 halves;
  std::memcpy(&halves, &lanes, sizeof(halves));
  return (halves[0] & halves[1]) == -1;
}

// Four points of one step at once, with the same operations as one by one. False, and nothing done, where one cannot be.
[[gnu::always_inline]] inline bool move_four(const LidarPoint* p, const Step& step, const Limits& limits, PointXYZI* out) {
  const Int4 offsets = {p[0].offset_ns, p[1].offset_ns, p[2].offset_ns, p[3].offset_ns};
  const Int4 since = offsets - static_cast<int>(step.begin);
  Float4 x[4];
  for (int k = 0; k < 4; ++k) std::memcpy(&x[k], &p[k].x, sizeof(x[k]));
  transpose(x);
  const Float4 range2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
  const Int4 usable =
      (range2 > limits.beyond_body2) & (range2 <= limits.farthest2) & (since >= 0) & (since < static_cast<int>(step.end - step.begin));
  if (!all(usable)) return false;
  const Float4 s = __builtin_convertvector(since, Float4) * inverse_step;
  const Pair& pair = *step.pair;
  Float4 y[4];
  for (std::size_t k = 0; k < 3; ++k) {
    const auto of = [&](std::size_t row) __attribute__((always_inline)) {
      return pair.column[0][row] * x[0] + pair.column[1][row] * x[1] + pair.column[2][row] * x[2] + pair.column[3][row];
    };
    const Float4 a = of(k), b = of(4 + k);
    y[k] = a + s * (b - a);
  }
  y[3] = x[3] - x[3] == 0 ? x[3] : Float4{};
  transpose(y);
  std::memcpy(out->data(), y, sizeof(y));
  return true;
}

// Writes the points that can be used; how many.
KILVO_WIDE std::size_t move_points(std::span<const LidarPoint> points, const Pair* pairs, const Limits& limits, OwnBody* body,
                                   PointDrops& drops, PointXYZI* out) {
  Step step;
  std::size_t used = 0, i = 0;
  while (i < points.size()) {
    if (i + 4 <= points.size() && move_four(&points[i], step, limits, out + used)) [[likely]] {
      i += 4;
      used += 4;
      continue;
    }
    const LidarPoint& p = points[i++];
    const float range2 = p.x * p.x + p.y * p.y + p.z * p.z;
    const std::int64_t offset = limits.base + p.offset_ns;
    if (!(range2 >= limits.nearest2 && range2 <= limits.farthest2) || offset < 0 || offset > limits.span) [[unlikely]] {
      count_drop(p, limits, drops);
      continue;
    }
    if (range2 <= limits.beyond_body2 && body != nullptr && body->meets(p)) {
      ++drops.own_body;
      continue;
    }
    step = step_of(p.offset_ns, pairs, limits);
    const Float4 x = moved(p, step);
    std::memcpy(out[used++].data(), &x, sizeof(x));
  }
  return used;
}

// A point may lie this far outside the trajectory (the last points of a scan, a first scan cut by the start) and take its end pose.
constexpr Duration slack = std::chrono::milliseconds(5);

}  // namespace

std::vector<PointXYZI> undistort(const LidarScan& scan, const Trajectory& trajectory, Time at, const LidarMount& mount, PointDrops& drops,
                                 OwnBody* body) {
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
  const OffsetRange all = offsets_of(scan);
  std::int64_t earliest = all.first, latest = all.last;
  if (earliest < lowest || latest > highest) {
    earliest = highest;
    latest = lowest;
    for (const LidarPoint& p : scan.points) {
      const bool within = p.offset_ns >= lowest && p.offset_ns <= highest;
      earliest = within && p.offset_ns < earliest ? p.offset_ns : earliest;
      latest = within && p.offset_ns > latest ? p.offset_ns : latest;
    }
  }
  if (highest < lowest || latest < earliest) {
    drops.outside_trajectory += static_cast<std::uint32_t>(scan.points.size());
    return out;
  }
  const auto count = static_cast<std::size_t>((latest - earliest) / step_ns) + 1;
  const std::vector<Pair> pairs = relative_poses(trajectory, T_WI->inverse(), mount.T_imu_lidar, scan.t + Duration(earliest), count);
  const auto nearest = static_cast<float>(mount.min_range), farthest = static_cast<float>(mount.max_range);
  const float beyond_body = body == nullptr ? nearest : std::max(nearest, body->reach());
  const Limits limits{nearest * nearest, farthest * farthest, beyond_body * beyond_body, -earliest, latest - earliest};
  out.resize(scan.points.size());
  out.resize(move_points(scan.points, pairs.data(), limits, body, drops, out.data()));
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
