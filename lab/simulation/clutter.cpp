#include "lab/simulation/clutter.hpp"

#include <algorithm>
#include <numbers>

#include "lab/simulation/random.hpp"

namespace kilvo::lab {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint64_t clutter_stream = 60;
constexpr double clearance = 0.6;  // m, from the way of the pelvis: the arms of the robot do not touch
constexpr double around = 4;       // m beyond the way: what is farther is behind other things

// Leaves: 5 to 20 cm, each turned as it fell, within half an ellipsoid. Rays go on between them.
void add_heap(Scene& scene, const Vector3d& foot, double radius, std::size_t material, Random& random) {
  const Vector3d size(radius, radius * random.uniform(0.7, 1), radius * random.uniform(0.8, 2.5));
  for (int i = 0; i < 60; ++i) {
    Vector3d at = random.gaussian3().normalized().cwiseProduct(size) * std::cbrt(random.uniform());
    at.z() = std::abs(at.z());
    const Vector3d u = random.gaussian3().normalized(), v = u.cross(random.gaussian3()).normalized();
    const double length = random.uniform(0.05, 0.2), width = length * random.uniform(0.4, 0.8);
    scene.surfaces.push_back({foot + at - (length * u + width * v) / 2, length * u, width * v, material});
  }
}

// A box that stands turned and leans a little.
void add_carton(Scene& scene, const Vector3d& foot, double radius, std::size_t material, Random& random) {
  const SO3 R = SO3::Exp({0, 0, random.uniform(0, std::numbers::pi)}) * SO3::Exp(0.05 * random.gaussian3());
  const Vector3d x = R * Vector3d(radius * random.uniform(0.7, 1.3), 0, 0), y = R * Vector3d(0, radius * random.uniform(0.7, 1.3), 0);
  const Vector3d z = R * Vector3d(0, 0, radius * random.uniform(0.5, 3)), low = foot - (x + y) / 2;
  for (const Vector3d& corner : {low, Vector3d(low + z)}) scene.surfaces.push_back({corner, x, y, material});
  for (const Vector3d& corner : {low, Vector3d(low + y)}) scene.surfaces.push_back({corner, x, z, material});
  for (const Vector3d& corner : {low, Vector3d(low + x)}) scene.surfaces.push_back({corner, y, z, material});
}

struct Area {
  Vector2d low = Vector2d::Constant(1e9), high = Vector2d::Constant(-1e9);
  void include(const Vector2d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

std::vector<Vector2d> way_of(const Walk& walk) {
  std::vector<Vector2d> out;
  for (double t = 0; t <= walk.end(); t += 0.2) out.emplace_back(walk.pelvis(t).p.head<2>());
  return out;
}

// Where both the way is near and the scene has a floor.
Area where(const Scene& scene, const std::vector<Vector2d>& way) {
  Area floor, out;
  for (const Surface& s : scene.surfaces) {
    for (const Vector3d& p : {s.corner, Vector3d(s.corner + s.u + s.v)}) floor.include(p.head<2>());
  }
  for (const Vector2d& p : way) out.include(p);
  out.low = (out.low.array() - around).matrix().cwiseMax(floor.low);
  out.high = (out.high.array() + around).matrix().cwiseMin(floor.high);
  return out;
}

}  // namespace

Scene cluttered(Scene scene, const Walk& walk, int objects, std::uint64_t seed) {
  if (objects <= 0) return scene;
  Random random(seed, clutter_stream);
  const std::size_t leaves = scene.add({Pattern::rough, {0.05F, 0.12F, 0.03F}, {0.40F, 0.60F, 0.20F}, 0.45});
  const std::size_t card = scene.add({Pattern::rough, {0.30F, 0.22F, 0.12F}, {0.65F, 0.50F, 0.32F}, 0.35});
  const std::vector<Vector2d> way = way_of(walk);
  const Area area = where(scene, way);
  for (int tries = 0; objects > 0 && tries < 4000; ++tries) {
    const Vector2d p(random.uniform(area.low.x(), area.high.x()), random.uniform(area.low.y(), area.high.y()));
    const double radius = random.uniform(0.15, 0.4), kind = random.uniform();
    const double near = clearance + 1.3 * radius;
    if (std::ranges::any_of(way, [&](const Vector2d& q) { return (q - p).norm() < near; })) continue;
    const Vector3d foot(p.x(), p.y(), scene.ground.height(p.x(), p.y()));
    if (kind < 0.5) {
      add_heap(scene, foot, radius, leaves, random);
    } else if (kind < 0.8) {
      add_carton(scene, foot, radius, card, random);
    } else {
      scene.add_pole(p.x(), p.y(), 0.1 * radius, 1.5, card, 6);
    }
    --objects;
  }
  return scene;
}

}  // namespace kilvo::lab
