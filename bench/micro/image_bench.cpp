// What happens to an image of 640 x 512 before it says anything: grey, its pyramid; and where points are seen.
#include <benchmark/benchmark.h>
#include <random>
#include <vector>

#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/pyramid.hpp"

namespace kilvo {
namespace {

constexpr int width = 640, height = 512;
constexpr std::size_t points = 1000;

Image noise(int channels) {
  std::mt19937 random(3);
  Image out{width, height, channels, {}};
  for (int i = 0; i < width * height * channels; ++i) out.pixels.push_back(static_cast<std::uint8_t>(random()));
  return out;
}

CameraMount mount_of(const char* model) {
  CameraMount out;
  out.model = model;
  out.width = width;
  out.height = height;
  out.fx = out.fy = 400;
  out.cx = 319.5;
  out.cy = 255.5;
  out.distortion = {-0.1, 0.02, 1e-4, -1e-4};
  return out;
}

void grey_of_colour_640x512(benchmark::State& state) {
  const Image image = noise(3);
  for (auto _ : state) benchmark::DoNotOptimize(to_grey(image));
}
BENCHMARK(grey_of_colour_640x512);

void pyramid_640x512_4_levels(benchmark::State& state) {
  const GreyImage image = to_grey(noise(1));
  for (auto _ : state) benchmark::DoNotOptimize(pyramid_of(image, 4));
}
BENCHMARK(pyramid_640x512_4_levels);

template <class Function>
void for_points(benchmark::State& state, Function&& function) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  std::vector<Eigen::Vector3d> seen;
  for (std::size_t i = 0; i < points; ++i) seen.emplace_back(5 * uniform(random), 5 * uniform(random), 5);
  for (auto _ : state) {
    for (const Eigen::Vector3d& p_C : seen) benchmark::DoNotOptimize(function(p_C));
  }
}

void project_1k_radtan(benchmark::State& state) {
  const Camera camera(mount_of("pinhole_radtan"));
  for_points(state, [&](const Eigen::Vector3d& p_C) { return camera.project(p_C); });
}
BENCHMARK(project_1k_radtan);

void project_1k_radtan_with_jacobian(benchmark::State& state) {
  const Camera camera(mount_of("pinhole_radtan"));
  for_points(state, [&](const Eigen::Vector3d& p_C) { return camera.project_with_jacobian(p_C); });
}
BENCHMARK(project_1k_radtan_with_jacobian);

void project_1k_fisheye_with_jacobian(benchmark::State& state) {
  const Camera camera(mount_of("equidistant"));
  for_points(state, [&](const Eigen::Vector3d& p_C) { return camera.project_with_jacobian(p_C); });
}
BENCHMARK(project_1k_fisheye_with_jacobian);

}  // namespace
}  // namespace kilvo
