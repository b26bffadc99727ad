#include "lab/simulation/analytic_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace kilvo::lab {
namespace {

using std::numbers::pi;

// The six faces of an axis-aligned box.
void add_box(std::vector<Rectangle>& out, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const Eigen::Vector3d d = high - low;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d u = Eigen::Vector3d::Unit((axis + 1) % 3) * d[(axis + 1) % 3];
    const Eigen::Vector3d v = Eigen::Vector3d::Unit((axis + 2) % 3) * d[(axis + 2) % 3];
    out.push_back({low, u, v});
    out.push_back({low + Eigen::Vector3d::Unit(axis) * d[axis], u, v});
  }
}

// 0 before `still`, then smoothly (to the second derivative) to 1 within two seconds.
double awake(double s, double still) {
  const double x = std::clamp((s - still) / 2.0, 0.0, 1.0);
  return x * x * x * (10 - 15 * x + 6 * x * x);
}

// First and second derivative by central differences of fourth order; the path is smooth on the scale of h.
constexpr double h = 1e-3;
template <class F>
auto rate_of(F f, double s) {
  return ((f(s - 2 * h) - 8 * f(s - h) + 8 * f(s + h) - f(s + 2 * h)) / (12 * h)).eval();
}
template <class F>
auto second_rate_of(F f, double s) {
  return ((-f(s - 2 * h) + 16 * f(s - h) - 30 * f(s) + 16 * f(s + h) - f(s + 2 * h)) / (12 * h * h)).eval();
}

}  // namespace

AnalyticRoom::AnalyticRoom(const AnalyticRoomConfig& config)
    : config_(config), start_(time_from_ns(1'700'000'000'000'000'000)), random_(config.seed) {
  add_box(surfaces_, {-5.13, -4.21, -1.27}, {6.07, 4.42, 1.94});  // the room: floor 1.27 m below the head
  add_box(surfaces_, {2.11, 2.53, -1.27}, {3.42, 3.61, -0.53});   // furniture
  add_box(surfaces_, {-4.31, -3.57, -1.27}, {-3.18, -2.24, 0.38});
  add_box(surfaces_, {4.22, -3.12, -1.27}, {5.07, -1.13, 0.86});
  add_box(surfaces_, {-1.37, 3.58, -1.27}, {0.64, 4.13, 0.74});
}

SE3 AnalyticRoom::pose_at(double s) const {
  const double a = awake(s, config_.still), t = s - config_.still;
  const double sway = 0.02 * std::sin(2 * pi * 1.25 * t), bob = 0.015 * std::sin(2 * pi * 2.5 * t);
  const double roll = 0.03 * std::sin(2 * pi * 1.25 * t), pitch = 0.02 * std::sin(2 * pi * 2.5 * t + 0.5);
  Eigen::Vector3d p;
  double yaw;
  if (config_.path == AnalyticRoomConfig::Path::loop) {
    const double w = 2 * pi / 20;
    p = {1.8 * std::sin(w * t), 1.4 * (1 - std::cos(w * t)) - 1.0, bob};
    yaw = 0.9 * std::sin(w * t) + 0.2 * std::sin(2 * pi * 0.4 * t);
  } else {
    p = {2.5 * std::sin(2 * pi / 24 * t), sway, bob};
    yaw = 0.03 * std::sin(2 * pi * 1.25 * t);
  }
  const SO3 R = SO3::Exp({0, 0, a * yaw}) * SO3::Exp({0, a * pitch, 0}) * SO3::Exp({a * roll, 0, 0});
  return {R, a * p};
}

SE3 AnalyticRoom::truth(Time t) const { return pose_at(seconds_of(t)); }

Eigen::Vector3d AnalyticRoom::velocity(Time t) const {
  return rate_of([this](double x) { return pose_at(x).p; }, seconds_of(t));
}

Eigen::Vector3d AnalyticRoom::gaussian() {
  std::normal_distribution<double> n;
  const double x = n(random_), y = n(random_);
  return {x, y, n(random_)};
}

ImuSample AnalyticRoom::imu_at(double s) {
  const SE3 T = pose_at(s);
  const Eigen::Vector3d accel = second_rate_of([this](double x) { return pose_at(x).p; }, s);
  // omega from Log(R(s)' R(s + x)) / x at x = 0.
  const Eigen::Vector3d omega = rate_of([&](double x) { return (T.R.inverse() * pose_at(x).R).Log(); }, s);
  const double root_rate = std::sqrt(config_.imu_rate);
  ImuSample out;
  out.t = start_ + from_seconds(s);
  out.gyro = omega + config_.gyro_bias + config_.gyro_noise * root_rate * gaussian();
  out.accel =
      T.R.inverse() * (accel + Eigen::Vector3d(0, 0, analytic_gravity)) + config_.accel_bias + config_.accel_noise * root_rate * gaussian();
  return out;
}

double AnalyticRoom::range_to_surface(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Rectangle& r : surfaces_) {
    const Eigen::Vector3d n = r.u.cross(r.v);
    const double along = n.dot(direction);
    if (std::abs(along) < 1e-12) continue;
    const double range = n.dot(r.corner - origin) / along;
    if (range < 0.05 || range >= nearest) continue;
    const Eigen::Vector3d x = origin + range * direction - r.corner;
    const double a = x.dot(r.u) / r.u.squaredNorm(), b = x.dot(r.v) / r.v.squaredNorm();
    if (a >= 0 && a <= 1 && b >= 0 && b <= 1) nearest = range;
  }
  return nearest;
}

LidarScan AnalyticRoom::scan_at(double s) {
  LidarScan scan;
  scan.t = start_ + from_seconds(s);
  const double period = 1.0 / config_.scan_rate;
  std::uniform_real_distribution<double> uniform(0.0, 2 * pi);
  std::normal_distribution<double> n;
  const double phase = uniform(random_);
  scan.points.reserve(static_cast<std::size_t>(config_.points_per_scan));
  for (int i = 0; i < config_.points_per_scan; ++i) {
    const double offset = period * i / config_.points_per_scan;
    // A non-repeating rosette: turns about once per scan while the elevation sweeps up and down.
    const double azimuth = phase + 2 * pi * 1.02 * i / config_.points_per_scan;
    const double elevation = 0.4 * std::sin(phase + 0.5236 * i) + 0.3;
    const SE3 T = pose_at(s + offset) * config_.T_imu_lidar;
    const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), -std::sin(elevation));
    const double range = range_to_surface(T.p, T.R * direction);
    if (range > config_.max_range) continue;
    const Eigen::Vector3d across = config_.angle_noise * gaussian();
    const Eigen::Vector3d measured =
        (range + config_.range_noise * n(random_)) * (direction + across - across.dot(direction) * direction).normalized();
    const Eigen::Vector3f p = measured.cast<float>();
    scan.points.push_back({p.x(), p.y(), p.z(), 100.0f, static_cast<std::int32_t>(std::llround(offset * 1e9))});
  }
  return scan;
}

std::optional<Measurement> AnalyticRoom::next() {
  const double imu_time = static_cast<double>(imu_index_) / config_.imu_rate;
  const double scan_time = static_cast<double>(scan_index_) / config_.scan_rate;
  const double scan_end = scan_time + 1.0 / config_.scan_rate;
  if (imu_time > config_.duration) return std::nullopt;
  if (scan_end < imu_time) {
    ++scan_index_;
    return scan_at(scan_time);
  }
  ++imu_index_;
  return imu_at(imu_time);
}

}  // namespace kilvo::lab
