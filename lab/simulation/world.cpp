#include "lab/simulation/world.hpp"

#include <array>
#include <cmath>
#include <embree3/rtcore.h>
#include <numbers>
#include <stdexcept>

#include "lab/simulation/random.hpp"

namespace kilvo::lab {

namespace {

constexpr int most_looks = 24;
constexpr float nearest = 0.05F;  // m

// Circles in a row with weights like an upturned parabola, which let through little of what is finer than a pixel.
struct Row {
  std::array<float, most_looks> weights{};
  double apart = 0;  // for a standard deviation of 1
};

const std::array<Row, most_looks + 1>& rows() {
  static const std::array<Row, most_looks + 1> all = [] {
    std::array<Row, most_looks + 1> out;
    out[1].weights[0] = 1;
    for (int n = 2; n <= most_looks; ++n) {
      const auto place = [n](int k) { return (2.0 * k + 1 - n) / n; };
      double sum = 0, squares = 0;
      for (int k = 0; k < n; ++k) sum += 1 - place(k) * place(k);
      Row& row = out[static_cast<std::size_t>(n)];
      for (int k = 0; k < n; ++k) {
        const double weight = (1 - place(k) * place(k)) / sum;
        row.weights[static_cast<std::size_t>(k)] = static_cast<float>(weight);
        squares += weight * place(k) * place(k);
      }
      row.apart = 2.0 / n / std::sqrt(squares);
    }
    return out;
  }();
  return all;
}

// An ellipse on a surface as a row of circles.
struct Looks {
  int count = 1;
  double sigma = 0;       // m, of each circle
  Eigen::Vector2d apart;  // m
};

// `right`, `down`: what a pixel is on the surface; `blur`: of the Gaussian, in pixels.
Looks looks_through(const Eigen::Vector2d& right, const Eigen::Vector2d& down, double blur) {
  constexpr double per_sigma = 1.8, round = 1.15, longest = most_looks / per_sigma;
  const double a = right.x() * right.x() + down.x() * down.x(), c = right.y() * right.y() + down.y() * down.y();
  const double b = right.x() * right.y() + down.x() * down.y(), middle = (a + c) / 2, spread = std::sqrt((a - c) * (a - c) / 4 + b * b);
  const double large = blur * blur * (middle + spread), small = std::max(blur * blur * (middle - spread), large / (longest * longest));
  if (large < round * round * small) return {1, std::sqrt((large + small) / 2), Eigen::Vector2d::Zero()};
  // The row's variance makes up for what the circles lack.
  const double lack = std::sqrt(large - small), sigma = std::sqrt(small);
  const int count = std::clamp(1 + static_cast<int>(per_sigma * lack / sigma), 2, most_looks);
  const Eigen::Vector2d along = a > c ? Eigen::Vector2d((a - c) / 2 + spread, b) : Eigen::Vector2d(b, (c - a) / 2 + spread);
  return {count, sigma, rows()[static_cast<std::size_t>(count)].apart * lack * along.normalized()};
}

}  // namespace

struct World::Rays {
  explicit Rays(const std::vector<Surface>& surfaces) : device(rtcNewDevice(nullptr)), scene(rtcNewScene(device)) {
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4 * surfaces.size()));
    auto* triangles = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), 2 * surfaces.size()));
    unsigned first = 0;
    for (const Surface& s : surfaces) {
      for (const Eigen::Vector3d& p :
           {s.corner, Eigen::Vector3d(s.corner + s.u), Eigen::Vector3d(s.corner + s.u + s.v), Eigen::Vector3d(s.corner + s.v)}) {
        for (int i = 0; i < 3; ++i) *vertices++ = static_cast<float>(p[i]);
      }
      for (const unsigned corner : {0U, 1U, 2U, 0U, 2U, 3U}) *triangles++ = first + corner;
      first += 4;
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) throw std::runtime_error("Embree could not take the world's triangles");
  }
  ~Rays() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Rays(const Rays&) = delete;
  Rays& operator=(const Rays&) = delete;

  RTCDevice device;
  RTCScene scene;
};

std::size_t Scene::add(const Material& material) {
  materials.push_back(material);
  return materials.size() - 1;
}

void Scene::add_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, std::size_t material) {
  const Eigen::Vector3d d = high - low;
  for (int axis = 0; axis < 3; ++axis) {
    // The edge that runs up, if there is one, is v: bricks lie.
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    const Eigen::Vector3d u = Eigen::Vector3d::Unit(a) * d[a], v = Eigen::Vector3d::Unit(b) * d[b];
    surfaces.push_back({low, u, v, material});
    surfaces.push_back({low + Eigen::Vector3d::Unit(axis) * d[axis], u, v, material});
  }
}

void Scene::add_pole(double x, double y, double radius, double height, std::size_t material, int sides) {
  const auto corner = [&](int i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    return Eigen::Vector3d(x + radius * std::cos(angle), y + radius * std::sin(angle), 0);
  };
  for (int i = 0; i < sides; ++i) surfaces.push_back({corner(i), corner(i + 1) - corner(i), Eigen::Vector3d(0, 0, height), material});
}

void Scene::add_plates(std::size_t material) {
  constexpr double below = -0.1;
  for (const GroundPlate& p : ground.plates()) {
    const Eigen::Vector3d low(p.x0, p.y0, p.z0), along(p.x1 - p.x0, 0, p.z1 - p.z0), across(0, p.y1 - p.y0, 0);
    surfaces.push_back({low, along, across, material});
    const Eigen::Vector3d down0(0, 0, below - p.z0), down1(0, 0, below - p.z1), down(0, 0, below - std::max(p.z0, p.z1));
    surfaces.push_back({low, across, down0, material});
    surfaces.push_back({low + along, across, down1, material});
    surfaces.push_back({low, along, down, material});
    surfaces.push_back({low + across, along, down, material});
  }
}

World::World(Scene scene, std::uint64_t seed) : scene_(std::move(scene)), rays_(std::make_unique<Rays>(scene_.surfaces)) {
  for (int i = 0; i < pattern_count; ++i) textures_.emplace_back(static_cast<Pattern>(i), seed);
  const Eigen::Vector3d light = Eigen::Vector3d(0.35, 0.55, 0.76).normalized();
  Random random(seed, 77);
  for (const Surface& s : scene_.surfaces) {
    const auto shade = static_cast<float>(0.72 + 0.28 * std::abs(s.normal().dot(light)));
    const double u = random.uniform(0, 4), v = random.uniform(0, 4);
    const Material& m = scene_.materials[s.material];
    faces_.push_back({s.corner,
                      s.normal(),
                      s.u.normalized(),
                      s.v.normalized(),
                      {u, v},
                      shade * m.dark,
                      shade * (m.bright - m.dark),
                      &textures_[static_cast<std::size_t>(m.pattern)]});
  }
}

World::World(World&&) noexcept = default;
World::~World() = default;

std::optional<Hit> World::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  const auto at = [](double x) { return static_cast<float>(x); };
  RTCRayHit query{};
  query.ray = {at(origin.x()),
               at(origin.y()),
               at(origin.z()),
               nearest,
               at(direction.x()),
               at(direction.y()),
               at(direction.z()),
               0,
               std::numeric_limits<float>::infinity(),
               ~0U,
               0,
               0};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(rays_->scene, &context, &query);
  return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::nullopt : hit_on(query.hit.primID, origin, direction);
}

std::array<std::optional<Hit>, World::bundle> World::cast(const Eigen::Vector3d& origin,
                                                          const std::array<Eigen::Vector3d, bundle>& directions) const {
  const Eigen::Vector3f from = origin.cast<float>();
  alignas(64) std::array<int, bundle> valid;
  valid.fill(-1);
  RTCRayHit16 query;
  for (std::size_t i = 0; i < bundle; ++i) {
    const Eigen::Vector3f direction = directions[i].cast<float>();
    query.ray.org_x[i] = from.x();
    query.ray.org_y[i] = from.y();
    query.ray.org_z[i] = from.z();
    query.ray.dir_x[i] = direction.x();
    query.ray.dir_y[i] = direction.y();
    query.ray.dir_z[i] = direction.z();
    query.ray.tnear[i] = nearest;
    query.ray.tfar[i] = std::numeric_limits<float>::infinity();
    query.ray.time[i] = 0;
    query.ray.mask[i] = ~0U;
    query.ray.id[i] = query.ray.flags[i] = 0;
    query.hit.geomID[i] = query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid.data(), rays_->scene, &context, &query);
  std::array<std::optional<Hit>, bundle> out;
  for (std::size_t i = 0; i < bundle; ++i) {
    if (query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) out[i] = hit_on(query.hit.primID[i], origin, directions[i]);
  }
  return out;
}

// Which surface is Embree's to say; where on it, to the last bit, is not left to single precision.
std::optional<Hit> World::hit_on(unsigned triangle, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  Hit hit;
  hit.surface = triangle / 2;
  const Face& face = faces_[hit.surface];
  const double along = face.normal.dot(direction);
  if (std::abs(along) < 1e-9) return std::nullopt;
  hit.range = face.normal.dot(face.corner - origin) / along;
  hit.cosine = std::abs(along);
  const Eigen::Vector3d x = origin + hit.range * direction - face.corner;
  hit.u = x.dot(face.u);
  hit.v = x.dot(face.v);
  return hit;
}

Colour World::radiance(const Hit& hit, const PixelRay& ray, double blur) const {
  const Face& face = faces_[hit.surface];
  const double along = face.normal.dot(ray.direction);
  const auto on_surface = [&](const Eigen::Vector3d& change) {
    const Eigen::Vector3d d = hit.range * (change - face.normal.dot(change) / along * ray.direction);
    return Eigen::Vector2d(d.dot(face.u), d.dot(face.v));
  };
  return radiance(hit, on_surface(ray.right), on_surface(ray.down), blur);
}

Colour World::radiance(const Hit& hit, const Eigen::Vector2d& right, const Eigen::Vector2d& down, double blur) const {
  const Face& face = faces_[hit.surface];
  const Looks looks = looks_through(right, down, blur);
  const Eigen::Vector2d first = Eigen::Vector2d(hit.u, hit.v) + face.offset - (looks.count - 1) / 2.0 * looks.apart;
  const std::span weights(rows()[static_cast<std::size_t>(looks.count)].weights.data(), static_cast<std::size_t>(looks.count));
  return face.dark + face.texture->along({first, looks.apart, weights}, Texture::blur_of(looks.sigma)) * face.more;
}

double World::reflectivity(const Hit& hit) const { return scene_.materials[scene_.surfaces[hit.surface].material].reflectivity; }

}  // namespace kilvo::lab
