// The worlds, each built of boxes, poles and plates.
#include <cmath>
#include <stdexcept>

#include "lab/simulation/random.hpp"
#include "lab/simulation/world.hpp"

namespace kilvo::lab {
namespace {

using Eigen::Vector3d;

struct Palette {
  std::size_t wall, blank, floor, ceiling, wood, cloth, metal, poster, bricks, grass, paving;
};

Palette add_palette(Scene& scene) {
  Palette p{};
  p.wall = scene.add({Pattern::rough, {0.50F, 0.48F, 0.42F}, {0.85F, 0.83F, 0.78F}, 0.6});
  p.blank = scene.add({Pattern::plain, {0.70F, 0.70F, 0.70F}, {0.74F, 0.74F, 0.72F}, 0.6});
  p.floor = scene.add({Pattern::boards, {0.12F, 0.08F, 0.05F}, {0.75F, 0.55F, 0.35F}, 0.4});
  p.ceiling = scene.add({Pattern::tiles, {0.55F, 0.55F, 0.55F}, {0.95F, 0.95F, 0.95F}, 0.7});
  p.wood = scene.add({Pattern::boards, {0.15F, 0.10F, 0.04F}, {0.60F, 0.42F, 0.22F}, 0.4});
  p.cloth = scene.add({Pattern::rough, {0.05F, 0.10F, 0.25F}, {0.35F, 0.45F, 0.75F}, 0.25});
  p.metal = scene.add({Pattern::tiles, {0.25F, 0.28F, 0.28F}, {0.65F, 0.68F, 0.68F}, 0.8});
  p.poster = scene.add({Pattern::poster, {0.05F, 0.05F, 0.10F}, {0.95F, 0.80F, 0.60F}, 0.5});
  p.bricks = scene.add({Pattern::bricks, {0.20F, 0.10F, 0.08F}, {0.80F, 0.45F, 0.35F}, 0.45});
  p.grass = scene.add({Pattern::rough, {0.08F, 0.15F, 0.04F}, {0.45F, 0.60F, 0.25F}, 0.35});
  p.paving = scene.add({Pattern::bricks, {0.25F, 0.25F, 0.24F}, {0.75F, 0.74F, 0.70F}, 0.4});
  return p;
}

// A floor, a ceiling and four walls, each of its own material: x0, x1, y0, y1.
struct Shell {
  Vector3d low, high;
  std::size_t floor, ceiling;
  std::array<std::size_t, 4> walls;
};

void add_shell(Scene& scene, const Shell& s) {
  const Vector3d d = s.high - s.low, x(d.x(), 0, 0), y(0, d.y(), 0), z(0, 0, d.z());
  scene.surfaces.push_back({s.low, x, y, s.floor});
  scene.surfaces.push_back({s.low + z, x, y, s.ceiling});
  scene.surfaces.push_back({s.low, y, z, s.walls[0]});
  scene.surfaces.push_back({s.low + x, y, z, s.walls[1]});
  scene.surfaces.push_back({s.low, x, z, s.walls[2]});
  scene.surfaces.push_back({s.low + y, x, z, s.walls[3]});
}

void add_table(Scene& scene, double x, double y, double w, double d, std::size_t material) {
  scene.add_box({x, y, 0.70}, {x + w, y + d, 0.74}, material);
  for (const double lx : {x + 0.03, x + w - 0.08}) {
    for (const double ly : {y + 0.03, y + d - 0.08}) scene.add_box({lx, ly, 0}, {lx + 0.05, ly + 0.05, 0.70}, material);
  }
}

// Walls 11.2 x 8.6 m; the furniture stands along them and leaves the middle free.
void furnish(Scene& scene, const Palette& p, Random& random) {
  const auto j = [&] { return random.uniform(-0.12, 0.12); };
  double a = j(), b = j();
  scene.add_box({-4.9, -3.4 + a, 0}, {-4.5, -2.2 + a, 1.9}, p.wood);  // shelf
  scene.add_box({-4.9, 1.2 + b, 0}, {-4.4, 2.4 + b, 0.9}, p.metal);
  a = j(), b = j();
  add_table(scene, 2.6 + a, 2.4 + b, 1.6, 0.8, p.wood);
  scene.add_box({2.9 + a, 2.6 + b, 0.74}, {3.2 + a, 2.9 + b, 1.1}, p.metal);  // on the table
  a = j();
  scene.add_box({-1.6 + a, 3.5, 0}, {0.4 + a, 4.2, 0.42}, p.cloth);  // sofa and its back
  scene.add_box({-1.6 + a, 4.05, 0.42}, {0.4 + a, 4.2, 0.85}, p.cloth);
  a = j(), b = j();
  scene.add_box({5.2, -3.0 + a, 0}, {5.9, -1.4 + a, 1.2}, p.wood);
  scene.add_box({-2.4 + b, -3.9, 0}, {-1.2 + b, -3.3, 0.75}, p.cloth);
  scene.add_box({1.5 + b, -3.9, 0}, {2.1 + b, -3.5, 2.1}, p.wood);
  scene.add_pole(5.0 + a, 2.3 + b, 0.12, 2.8, p.metal);
  scene.add_box({-3.6, 3.3, 0}, {-3.1, 3.8, 0.5}, p.poster);
  for (int i = 0; i < 5; ++i) {  // pictures, a centimetre before the walls
    const double x = -4.2 + 2.1 * i + j(), z = 1.2 + random.uniform(0, 0.3), w = random.uniform(0.5, 1.1);
    scene.surfaces.push_back({{x, -3.99, z}, {w, 0, 0}, {0, 0, 0.7}, p.poster});
    scene.surfaces.push_back({{x + 0.4, 4.29, z + 0.1}, {w, 0, 0}, {0, 0, 0.6}, p.poster});
  }
}

void make_room(Scene& scene, Random& random, bool blank) {
  const Palette p = add_palette(scene);
  const double w = random.uniform(-0.2, 0.2);
  add_shell(scene, {{-5, -4, 0}, {6.2 + w, 4.3, 2.9}, p.floor, p.ceiling, {p.bricks, blank ? p.blank : p.wall, p.wall, p.wall}});
  furnish(scene, p, random);
}

// 40 m long; doors and cupboards only near its ends, nothing but parallel planes between x = 10 and x = 26. `blank`: its long walls have no
// texture.
void make_corridor(Scene& scene, Random& random, bool blank) {
  const Palette p = add_palette(scene);
  const std::size_t wall = blank ? p.blank : p.wall;
  add_shell(scene, {{-3, -1.2, 0}, {37, 1.2, 2.6}, p.floor, p.ceiling, {p.bricks, p.bricks, wall, wall}});
  for (const double base : {-2.5, 27.5}) {
    for (int i = 0; i < 4; ++i) {
      const double x = base + 2.4 * i + random.uniform(-0.2, 0.2), depth = random.uniform(0.15, 0.35), height = random.uniform(0.8, 2.2);
      scene.add_box({x, 1.2 - depth, 0}, {x + 0.9, 1.2, height}, i % 2 == 0 ? p.wood : p.metal);
      scene.add_box({x + 1.1, -1.2, 0}, {x + 1.9, -1.2 + 0.8 * depth, 0.9 * height}, i % 2 == 0 ? p.cloth : p.poster);
    }
  }
}

// Grass, a paved ramp with a plateau, boards, poles, walls and trees.
void make_yard(Scene& scene, Random& random) {
  const Palette p = add_palette(scene);
  scene.surfaces.push_back({{-40, -40, 0}, {80, 0, 0}, {0, 80, 0}, p.grass});
  const double top = 0.33 + random.uniform(-0.04, 0.04);
  for (const GroundPlate& plate : {GroundPlate{2, 5, -1.5, 1.5, 0, top}, {5, 7, -1.5, 1.5, top, top}, {7, 10, -1.5, 1.5, top, 0}})
    scene.ground.add(plate);
  for (int i = 0; i < 6; ++i) {  // boards to step on
    const double x = -3.4 + 0.75 * i, h = 0.01 + 0.004 * (i % 3);
    scene.ground.add({x, x + 0.3, -3.2, -0.4, h, h});
  }
  scene.add_plates(p.paving);
  for (int i = 0; i < 14; ++i) {
    const double angle = 0.45 * i + random.uniform(0, 0.2), r = random.uniform(5, 14);
    const double x = 3 + r * std::cos(angle), y = r * std::sin(angle);
    const bool on_the_running_track = x < 5 && std::abs(y + 4.5) < 1.2;
    if (std::abs(y) < 2.5 || on_the_running_track) continue;
    const double height = random.uniform(2.5, 5);
    scene.add_pole(x, y, random.uniform(0.08, 0.2), height, i % 2 == 0 ? p.wood : p.metal);
    if (i % 2 == 0) scene.add_box({x - 0.8, y - 0.8, height}, {x + 0.8, y + 0.8, height + 1.2}, p.grass);
  }
  scene.add_box({-12, 8, 0}, {4, 8.4, 2.4}, p.bricks);
  scene.add_box({-9, -11, 0}, {-3, -7, 3.2}, p.bricks);
  scene.add_box({12, -8, 0}, {16, -4, 2.8}, p.wall);
  scene.add_box({5, -6.5, 0}, {7, -5.7, 0.9}, p.paving);
  scene.add_box({17, 2, 0}, {17.3, 12, 2}, p.poster);
}

void make_stairs(Scene& scene, Random& random) {
  const Palette p = add_palette(scene);
  add_shell(scene, {{-4, -2.6, 0}, {9, 2.8, 4.2}, p.floor, p.ceiling, {p.bricks, p.wall, p.wall, p.bricks}});
  constexpr double tread = 0.28, riser = 0.10;
  constexpr int count = 6;
  for (int i = 0; i < count; ++i) {
    scene.ground.add({1 + tread * i, i + 1 < count ? 1 + tread * (i + 1) : 5.5, -1.2, 1.2, riser * (i + 1), riser * (i + 1)});
  }
  scene.add_plates(p.paving);
  scene.add_box({-3.6, 1.6, 0}, {-2.6, 2.4, 1.1}, p.wood);
  scene.add_box({6.6, -2.4, 0}, {7.4, -1.2 + random.uniform(-0.2, 0.2), 1.6}, p.metal);
  scene.add_box({7.8, 1.2, 0}, {8.6, 2.2, 2.2}, p.cloth);
  for (int i = 0; i < 5; ++i) {
    const double x = -3 + 2.2 * i + random.uniform(-0.2, 0.2);
    scene.surfaces.push_back({{x, -2.59, 1.2}, {0.9, 0, 0}, {0, 0, 0.7}, p.poster});
    scene.surfaces.push_back({{x + 0.5, 2.79, 1.5}, {0.7, 0, 0}, {0, 0, 0.9}, p.poster});
  }
}

}  // namespace

Scene make_scene(const std::string& name, std::uint64_t seed) {
  Scene scene;
  Random random(seed, 5);
  if (name == "room")
    make_room(scene, random, false);
  else if (name == "blank_wall")
    make_room(scene, random, true);
  else if (name == "corridor" || name == "corridor_blank")
    make_corridor(scene, random, name == "corridor_blank");
  else if (name == "yard")
    make_yard(scene, random);
  else if (name == "stairs")
    make_stairs(scene, random);
  else
    throw std::invalid_argument("no world is called " + name);
  return scene;
}

}  // namespace kilvo::lab
