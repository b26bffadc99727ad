#include "lab/simulation/texture.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "lab/simulation/random.hpp"

namespace kilvo::lab {
namespace {

constexpr int size = 1024;       // texels, a power of two
constexpr double texel = 0.004;  // m
constexpr double side = size * texel;
// Variances of blurs in texels squared: of a copy, and of the cubic B-spline that joins its texels.
constexpr double of_copy = 1.0 / 4, of_spline = 1.0 / 3;

using Grid = std::vector<float>;

// Of a texel, or of a cell of n in a row.
std::size_t index_of(int x, int y, int n = size) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(n) + static_cast<std::size_t>(x);
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

// What comes before the first and after the last value is there twice, so that a spline finds its four by four.
Grid with_margin(const Grid& grid, std::size_t n) {
  Grid out;
  out.reserve((n + 3) * (n + 3));
  for (std::size_t y = 0; y < n + 3; ++y) {
    for (std::size_t x = 0; x < n + 3; ++x) out.push_back(grid[(y + n - 1) % n * n + (x + n - 1) % n]);
  }
  return out;
}

// Every second value, after the weights 1 3 3 1 along rows and columns: hardly anything is left that so few values could not tell from
// what is not there. If the variance of the blur was a quarter of a texel's square, it is a quarter of the new texel's.
Grid halved(const Grid& grid, std::size_t n) {
  const auto mix = [](float a, float b, float c, float d) { return (a + 3 * (b + c) + d) / 8; };
  const std::size_t half = n / 2;
  Grid rows(n * half), out(half * half);
  for (std::size_t y = 0; y < n; ++y) {
    const float* p = &grid[n * y];
    for (std::size_t x = 0; x < n; x += 2) rows[half * y + x / 2] = mix(p[(x + n - 1) % n], p[x], p[x + 1], p[(x + 2) % n]);
  }
  for (std::size_t y = 0; y < n; y += 2) {
    const std::size_t before = (y + n - 1) % n, after = (y + 2) % n;
    for (std::size_t x = 0; x < half; ++x) {
      out[y / 2 * half + x] = mix(rows[half * before + x], rows[half * y + x], rows[half * (y + 1) + x], rows[half * after + x]);
    }
  }
  return out;
}

// Each value with a share of its neighbours, along rows and columns: adds `variance` (in texels squared) to the blur's.
Grid softened(const Grid& grid, std::size_t n, double variance) {
  const auto share = static_cast<float>(variance / 2);
  Grid rows(grid.size()), out(grid.size());
  const auto mix = [share](float before, float here, float after) { return here + share * (before - 2 * here + after); };
  for (std::size_t y = 0; y < n; ++y) {
    for (std::size_t x = 0; x < n; ++x) rows[y * n + x] = mix(grid[y * n + (x + n - 1) % n], grid[y * n + x], grid[y * n + (x + 1) % n]);
  }
  for (std::size_t y = 0; y < n; ++y) {
    for (std::size_t x = 0; x < n; ++x) out[y * n + x] = mix(rows[(y + n - 1) % n * n + x], rows[y * n + x], rows[(y + 1) % n * n + x]);
  }
  return out;
}

// Of the four values around a place between the second and the third of them: a cubic B-spline, at so many places.
constexpr int places = 256;
using SplineTable = std::array<Eigen::Array4f, places>;
const SplineTable& spline_table() {
  static const SplineTable all = [] {
    SplineTable out;
    for (int i = 0; i < places; ++i) {
      const float f = (static_cast<float>(i) + 0.5F) / places, g = 1 - f, f2 = f * f, g2 = g * g;
      out[static_cast<std::size_t>(i)] = {g2 * g / 6, (4 - 3 * f2 * (2 - f)) / 6, (4 - 3 * g2 * (2 - g)) / 6, f2 * f / 6};
    }
    return out;
  }();
  return all;
}

// Metres as parts of the texture's side, of which 2^32 are the whole: what is beyond repeats by overflow.
std::uint32_t part_of_side(double metres) { return static_cast<std::uint32_t>(static_cast<std::int64_t>(metres * (0x1p32 / side))); }

// The row in one of the copies.
float seen_in(const Grid& grid, std::size_t level, const Texture::Row& row) {
  const SplineTable& table = spline_table();
  const auto doublings = std::bit_width(static_cast<unsigned>(size)) - 1 - static_cast<int>(level / 2);
  const std::size_t stride = (std::size_t{1} << doublings) + 3;
  const std::uint32_t half = 0x80000000U >> doublings, step_x = part_of_side(row.apart.x()), step_y = part_of_side(row.apart.y());
  std::uint32_t x = part_of_side(row.first.x()) - half, y = part_of_side(row.first.y()) - half;
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  for (const float weight : row.weights) {
    // Texel in the upper half, place beyond it in the lower one.
    const std::uint64_t column = std::uint64_t{x} << doublings, line = std::uint64_t{y} << doublings;
    const float* texels = grid.data() + (line >> 32) * stride + (column >> 32);
    const Eigen::Array4f &across = table[column >> 24 & 255], &down = table[line >> 24 & 255];
    const auto texels_of = [&](std::size_t r) { return Eigen::Map<const Eigen::Array4f>(texels + r * stride); };
    sum += weight * across * (down[0] * texels_of(0) + down[1] * texels_of(1) + down[2] * texels_of(2) + down[3] * texels_of(3));
    x += step_x;
    y += step_y;
  }
  return sum.sum();
}

}  // namespace

Texture::Texture(Pattern pattern, std::uint64_t seed) : plain_(pattern == Pattern::plain) {
  if (plain_) return;
  Grid grid = paint(pattern, seed);
  for (float& value : grid) value = std::clamp(value, 0.0F, 1.0F);
  grid = softened(grid, size, of_copy - 1.0 / 12);  // a painted texel is a box
  for (std::size_t n = size;; n /= 2) {
    levels_.push_back(with_margin(grid, n));
    levels_.push_back(with_margin(softened(grid, n, of_copy + of_spline), n));
    if (n == 1) break;
    grid = halved(grid, n);
  }
}

// From copy to copy the variance doubles: which one is the exponent of the ratio, and what the ratio has beyond a power of two is the share
// of the next one with which both together have the variance that is wanted.
Texture::Blur Texture::blur_of(double sigma) {
  constexpr double finest = texel * texel * (of_copy + of_spline);
  constexpr std::uint32_t coarsest = 2 * (std::bit_width(static_cast<unsigned>(size)) - 1), one = 0x3f800000, mantissa = 0x7fffff;
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(std::max(sigma * sigma / finest, 1.0)));
  const std::uint32_t level = (bits - one) >> 23;
  if (level >= coarsest) return {coarsest, 0};
  return {level, std::bit_cast<float>(one | (bits & mantissa)) - 1};
}

float Texture::along(const Row& row, const Blur& blur) const {
  if (plain_) return 0.5F;
  const float fine = seen_in(levels_[blur.level], blur.level, row);
  return blur.next > 0.01F ? fine + blur.next * (seen_in(levels_[blur.level + 1], blur.level + 1, row) - fine) : fine;
}

}  // namespace kilvo::lab
