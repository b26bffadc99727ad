// What the sensors see: triangles (two for each parallelogram) with procedural textures, and what a ray meets among them.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/simulation/footsteps.hpp"
#include "lab/simulation/texture.hpp"

namespace kilvo::lab {

using Colour = Eigen::Vector3f;  // red, green, blue reflectance, 0 to 1

struct Material {
  Pattern pattern = Pattern::rough;
  Colour dark{0.2F, 0.2F, 0.2F}, bright{0.8F, 0.8F, 0.8F};
  double reflectivity = 0.5;  // for the LiDAR
};

/// corner + a u + b v for a, b in [0, 1]; metres, in the world.
struct Surface {
  Eigen::Vector3d corner, u, v;
  std::size_t material = 0;

  Eigen::Vector3d normal() const { return u.cross(v).normalized(); }
};

/// Surfaces in the making, and where a robot may walk on them.
struct Scene {
  std::vector<Material> materials;
  std::vector<Surface> surfaces;
  Ground ground;
  Colour sky{0.75F, 0.85F, 0.95F};

  std::size_t add(const Material& material);
  /// Six faces, axis-parallel.
  void add_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, std::size_t material);
  /// An upright prism of `sides` faces.
  void add_pole(double x, double y, double radius, double height, std::size_t material, int sides = 10);
  /// The plates of the ground, with walls down to z = -0.1.
  void add_plates(std::size_t material);
};

struct Hit {
  double range = 0;         // m
  std::size_t surface = 0;  // index into World::surfaces()
  double u = 0, v = 0;      // m along the surface's edges
  double cosine = 1;        // of the angle of incidence
};

/// The ray of a pixel in the world, and what is added to its direction from this pixel to the next one on the right and below.
struct PixelRay {
  Eigen::Vector3d direction, right, down;
};

class World {
 public:
  World(Scene scene, std::uint64_t seed);
  World(World&&) noexcept;
  ~World();

  /// The nearest surface along a unit direction, at least 5 cm away. May be called by several threads.
  std::optional<Hit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  static constexpr std::size_t bundle = 16;
  /// The same of several directions at once; cheaper if they are similar.
  std::array<std::optional<Hit>, bundle> cast(const Eigen::Vector3d& origin, const std::array<Eigen::Vector3d, bundle>& directions) const;

  /// Light that comes from there, through a Gaussian of `blur` pixels: of the surface that is an ellipse, long where it is grazed.
  Colour radiance(const Hit& hit, const PixelRay& ray, double blur) const;
  /// The same where it is known how far a pixel to the right and a pixel below are on the surface, m.
  Colour radiance(const Hit& hit, const Eigen::Vector2d& right, const Eigen::Vector2d& down, double blur) const;
  const Colour& sky() const { return scene_.sky; }
  double reflectivity(const Hit& hit) const;

  const std::vector<Surface>& surfaces() const { return scene_.surfaces; }
  const Ground& ground() const { return scene_.ground; }

 private:
  struct Rays;  // Embree's
  /// A surface made ready: unit vectors, where in the texture its corner lies, its colours in the light that falls on it.
  struct Face {
    Eigen::Vector3d corner, normal, u, v;
    Eigen::Vector2d offset;
    Colour dark, more;  // what the texture's brightest has more than its darkest
    const Texture* texture;
  };
  std::optional<Hit> hit_on(unsigned triangle, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  Scene scene_;
  std::vector<Texture> textures_;  // by Pattern
  std::vector<Face> faces_;        // by surface
  std::unique_ptr<Rays> rays_;
};

/// The worlds that there are: room, corridor, corridor_blank, blank_wall, yard, stairs. The seed moves furniture and changes textures.
Scene make_scene(const std::string& name, std::uint64_t seed);

}  // namespace kilvo::lab
