#include "lab/simulation/lidar_sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "lab/simulation/no_sum.hpp"
#include "lab/simulation/random.hpp"
#include "lab/simulation/units.hpp"

namespace kilvo::lab {
namespace {

using std::numbers::pi;
constexpr std::uint64_t ray_stream = 31;

Eigen::Vector3d from_angles(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
}

// Does the ray pass a line segment from a to b nearer than `radius`?
bool hits_capsule(const Eigen::Vector3d& o, const Eigen::Vector3d& d, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
  const Eigen::Vector3d axis = b - a, w = o - a;
  const double k = axis.squaredNorm(), m = d.dot(axis), n = w.dot(axis), l = w.dot(d);
  const double denominator = k - m * m;
  // Nearest points of the two lines, then kept on the segment and before the sensor.
  const double s = std::clamp(denominator > 1e-12 ? (n - m * l) / denominator : 0.0, 0.0, 1.0);
  const double t = std::max(0.0, s * m - l);
  return (w + t * d - s * axis).squaredNorm() < radius * radius;
}

}  // namespace

Eigen::Vector3d ray_direction(const LidarModel& model, int i, double t, double phase) {
  if (model.scan == LidarModel::Scan::rosette) {
    // Turns a little more than once a scan while the elevation sweeps -7 to 52 degrees; neither divides the other, so no scan repeats.
    const double azimuth = phase + 2 * pi * 10.197 * t, sweep = 1637.31 * t + 0.25 * (i % 4);
    const double triangle = std::abs(2 * (sweep - std::floor(sweep)) - 1);
    return from_angles(azimuth, (-7 + 59 * triangle) * degree);
  }
  const int lines = model.scan == LidarModel::Scan::lines_16 ? 16 : 64;
  const double span = model.scan == LidarModel::Scan::lines_16 ? 30 : 45;
  const int columns = model.points / lines;
  const int column = i / lines;
  const double azimuth = phase - 2 * pi * column / std::max(columns, 1);
  return from_angles(azimuth, (-span / 2 + span * (i % lines) / (lines - 1)) * degree);
}

bool hits_own_body(const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  if (hits_capsule(o, d, {0, 0, 0}, {0, 0, 0.24}, 0.12)) return true;
  for (const double y : {-1.0, 1.0}) {
    if (hits_capsule(o, d, {0, 0.19 * y, 0.24}, {0.02, 0.22 * y, -0.05}, 0.05)) return true;
    if (hits_capsule(o, d, {0.02, 0.22 * y, -0.05}, {0.2, 0.2 * y, -0.1}, 0.04)) return true;
  }
  return false;
}

LidarSensor::LidarSensor(const SimulatorConfig& config, const World& world, double range_limit)
    : config_(config),
      world_(world),
      max_range_(range_limit > 0 ? std::min(range_limit, config.lidar.max_range) : config.lidar.max_range),
      phase_(Random(config.seed, ray_stream).uniform(0, 2 * pi)) {}

// What sends enough light back to be seen.
std::optional<Hit> LidarSensor::echo(const Ray& ray) const {
  const auto hit = world_.cast(ray.from, ray.way);
  if (!hit || hit->cosine < config_.lidar.least_cosine || hit->range < config_.lidar.min_range) return std::nullopt;
  // The echo of a darker or grazed surface is lost earlier: its power falls with the square of the range.
  if (hit->range > max_range_ * std::min(1.0, std::sqrt(world_.reflectivity(*hit) * hit->cosine / 0.1))) return std::nullopt;
  return hit;
}

// As it is measured, m; 0: not at all. `noise`: a Gaussian draw.
double LidarSensor::range_of(const Ray& ray, const Hit& hit, double noise) const {
  const auto& errors = config_.errors.lidar;
  if (!errors) return hit.range + config_.lidar.range_noise * noise;
  Random random(config_.seed, ray_stream + 2, ray.name);
  if (random.uniform() < errors->dropout) return 0;
  const double aside = errors->footprint / 2;
  const Eigen::Vector3d within(random.uniform(-aside, aside), random.uniform(-aside, aside), random.uniform(-aside, aside));
  double range = hit.range;
  const auto beside = world_.cast(ray.from, (ray.way + within).normalized());
  constexpr double apart = 0.1;  // m: surfaces that are farther from each other than a pulse is long
  if (beside && std::abs(beside->range - hit.range) > apart && random.uniform() < errors->mixed)
    range += random.uniform() * (beside->range - hit.range);
  constexpr double outlier = 5;
  const double sigma = errors->sigma(hit.cosine, hit.range) * (random.uniform() < errors->tail ? outlier : 1);
  return range + errors->bias(hit.cosine, world_.surfaces()[hit.surface].material) + sigma * noise;
}

LidarScan LidarSensor::scan(std::int64_t index, double begin, const std::function<SE3(double)>& torso_at, const Workers& workers) const {
  const LidarModel& model = config_.lidar;
  const double interval = 1 / model.delivery.rate / model.points;
  std::vector<LidarPoint> points(static_cast<std::size_t>(model.points));  // at the origin: no echo
  const SE3& T_TL = config_.shape.T_torso_lidar;
  const auto& errors = config_.errors.lidar;
  const auto cast = [&](std::size_t i, const std::array<SE3, 2>& ends, double share) {
    const double offset = interval * static_cast<double>(i);
    const Eigen::Vector3d direction = ray_direction(model, static_cast<int>(i), begin + offset, phase_);
    points[i].offset_ns = static_cast<std::int32_t>(std::llround(offset * 1e9));
    const auto put = [&](const Eigen::Vector3f& p, double intensity) {
      points[i] = {p.x(), p.y(), p.z(), std::round(static_cast<float>(intensity)), points[i].offset_ns};
    };
    if (const auto arm = errors ? errors->arm(direction, begin + offset) : std::nullopt) return put((*arm * direction).cast<float>(), 60);
    if (hits_own_body(T_TL.p, T_TL.R * direction)) return;
    const Eigen::Vector3d from = ends[0].p + share * (ends[1].p - ends[0].p), way = ends[0].R * direction;
    const Ray ray{from, (way + share * (ends[1].R * direction - way)).normalized(), static_cast<std::uint64_t>(index) * 1'000'003 + i};
    const auto hit = echo(ray);
    if (!hit) return;
    Random random(config_.seed, ray_stream + 1, ray.name);
    const double range = range_of(ray, *hit, random.gaussian());
    const Eigen::Vector3d tilt = model.angle_noise * random.gaussian3();
    put((range * (direction + tilt - tilt.dot(direction) * direction).normalized()).cast<float>(),
        range > 0 ? 255 * world_.reflectivity(*hit) * std::sqrt(hit->cosine) : 0);
  };
  // Within a quarter of a millisecond the body moves straight, to less than a micrometre.
  constexpr std::size_t straight = 50;
  workers.sum(points.size(), straight, NoSum{}, [&](std::size_t first, std::size_t last) {
    const auto pose_at = [&](std::size_t i) { return torso_at(begin + interval * static_cast<double>(i)) * T_TL; };
    const std::array<SE3, 2> ends{pose_at(first), pose_at(last)};
    for (std::size_t i = first; i < last; ++i) cast(i, ends, static_cast<double>(i - first) / static_cast<double>(last - first));
    return NoSum{};
  });
  LidarScan out;
  out.points.reserve(points.size());
  for (const LidarPoint& p : points) {
    if (errors || p.x != 0 || p.y != 0 || p.z != 0) out.points.push_back(p);  // drivers leave those without echo at (0, 0, 0)
  }
  return out;
}

}  // namespace kilvo::lab
