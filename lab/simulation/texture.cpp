#include "lab/simulation/texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "lab/simulation/random.hpp"

namespace kilvo::lab {
namespace {

constexpr int size = 1024;       // texels, a power of two
constexpr double texel = 0.004;  // m
constexpr double side = size * texel;

using Grid = std::vector<float>;

// Of a texel, or of a cell of n in a row.
std::size_t index_of(int x, int y, int n = size) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(n) + static_cast<std::size_t>(x);
}

// std::floor for what fits an int64; on plain x86-64 that is a call into the library, and every pixel asks many times.
double whole(double x) {
  const auto i = static_cast<double>(static_cast<std::int64_t>(x));
  return i > x ? i - 1 : i;
}

// Smooth noise that repeats with the texture: random values every `cell` texels, interpolated.
void add_noise(Grid& grid, int cell, float amplitude, Random random) {
  const int n = size / cell;
  std::vector<float> lattice(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  for (float& value : lattice) value = static_cast<float>(random.uniform(-1, 1)) * amplitude;
  const auto at = [&](int i, int j) { return lattice[index_of(i % n, j % n, n)]; };
  for (int y = 0; y < size; ++y) {
    const int j = y / cell;
    const auto fy = static_cast<float>(y % cell) / static_cast<float>(cell), wy = fy * fy * (3 - 2 * fy);
    for (int x = 0; x < size; ++x) {
      const int i = x / cell;
      const auto fx = static_cast<float>(x % cell) / static_cast<float>(cell), wx = fx * fx * (3 - 2 * fx);
      const float low = at(i, j) + wx * (at(i + 1, j) - at(i, j)), high = at(i, j + 1) + wx * (at(i + 1, j + 1) - at(i, j + 1));
      grid[index_of(x, y)] += low + wy * (high - low);
    }
  }
}

// Random rectangles, one over the other.
void add_rectangles(Grid& grid, int count, int least, int most, Random& random) {
  const auto between = [&](int a, int b) { return a + static_cast<int>(random.uniform() * (b - a + 1)); };
  for (int k = 0; k < count; ++k) {
    const int w = between(least, most), h = between(least, most), x0 = between(0, size - 1), y0 = between(0, size - 1);
    const auto value = static_cast<float>(random.uniform());
    for (int y = y0; y < y0 + h; ++y) {
      for (int x = x0; x < x0 + w; ++x) grid[index_of(x % size, y % size)] = value;
    }
  }
}

// A wall of blocks of w x h texels with joints; every other row is shifted by `shift`.
void add_blocks(Grid& grid, int w, int h, int shift, int joint, Random random) {
  const int columns = size / w, rows = size / h;
  std::vector<float> tone(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (float& value : tone) value = static_cast<float>(random.uniform(-0.2, 0.2));
  for (int y = 0; y < size; ++y) {
    const int row = y / h;
    for (int x = 0; x < size; ++x) {
      const int moved = (x + (row % 2) * shift) % size, column = moved / w;
      const bool in_joint = y % h < joint || moved % w < joint;
      grid[index_of(x, y)] += in_joint ? -0.35F : tone[index_of(column, row, columns)];
    }
  }
}

Grid paint(Pattern pattern, std::uint64_t seed) {
  Grid grid(static_cast<std::size_t>(size) * size, 0.5F);
  Random random(seed, static_cast<std::uint64_t>(pattern));
  if (pattern == Pattern::plain) return grid;
  if (pattern == Pattern::poster) add_rectangles(grid, 700, 12, 110, random);
  if (pattern == Pattern::bricks) add_blocks(grid, 64, 16, 32, 3, random);
  if (pattern == Pattern::boards) add_blocks(grid, 512, 32, 170, 2, random);
  if (pattern == Pattern::tiles) add_blocks(grid, 128, 128, 0, 3, random);
  const float noise = pattern == Pattern::rough ? 0.30F : pattern == Pattern::poster ? 0.03F : 0.10F;
  float amplitude = noise;
  for (const int cell : {64, 32, 16, 8, 4}) {
    add_noise(grid, cell, amplitude, Random(seed, static_cast<std::uint64_t>(pattern) + 100, static_cast<std::uint64_t>(cell)));
    amplitude *= 0.85F;
  }
  return grid;
}

std::vector<std::uint8_t> rounded(const Grid& grid) {
  std::vector<std::uint8_t> out(grid.size());
  std::ranges::transform(grid, out.begin(),
                         [](float v) { return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0F, 1.0F))); });
  return out;
}

Grid halved(const Grid& grid, std::size_t n) {
  Grid out(n * n / 4);
  for (std::size_t y = 0; y < n / 2; ++y) {
    for (std::size_t x = 0; x < n / 2; ++x) {
      const float* p = &grid[2 * y * n + 2 * x];
      out[y * (n / 2) + x] = (p[0] + p[1] + p[n] + p[n + 1]) / 4;
    }
  }
  return out;
}

}  // namespace

Texture::Texture(Pattern pattern, std::uint64_t seed) {
  Grid grid = paint(pattern, seed);
  for (float& value : grid) value = std::clamp(value, 0.0F, 1.0F);
  for (std::size_t n = size;; n /= 2) {
    levels_.push_back(rounded(grid));
    if (n == 1) break;
    grid = halved(grid, n);
  }
}

double Texture::bilinear(std::size_t level, double x, double y) const {
  const double n = static_cast<double>(size >> level), px = x * n - 0.5, py = y * n - 0.5, fx = whole(px), fy = whole(py);
  const auto mask = static_cast<std::size_t>((size >> level) - 1);
  const auto i = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(fx)) & mask,
             j = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(fy)) & mask;
  const std::size_t i1 = (i + 1) & mask, j1 = ((j + 1) & mask) * (mask + 1), j0 = j * (mask + 1);
  const auto& data = levels_[level];
  const double wx = px - fx, wy = py - fy;
  return ((1 - wy) * ((1 - wx) * data[j0 + i] + wx * data[j0 + i1]) + wy * ((1 - wx) * data[j1 + i] + wx * data[j1 + i1])) / 255;
}

double Texture::level_for(double footprint) {
  return std::clamp(std::log2(std::max(footprint, 1e-6) / texel), 0.0, std::log2(static_cast<double>(size)));
}

double Texture::at(double u, double v, double level) const {
  const double x = u / side - whole(u / side), y = v / side - whole(v / side);
  const auto below = std::min(static_cast<std::size_t>(level), levels_.size() - 2);
  const double f = level - static_cast<double>(below), fine = bilinear(below, x, y);
  return f > 0 ? fine + f * (bilinear(below + 1, x, y) - fine) : fine;
}

}  // namespace kilvo::lab
