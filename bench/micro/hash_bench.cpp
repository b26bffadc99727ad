// 20 000 look-ups in an index of 200 000 voxels: our own open addressing against tsl::robin_map and std::unordered_map, on the same keys.
// `scattered`: anywhere in the map. `sweep`: near the robot, as the points of a sweep fall. One in eight is not in the map.
#include <benchmark/benchmark.h>
#include <cmath>
#include <numbers>
#include <random>
#include <tsl/robin_map.h>
#include <unordered_map>
#include <vector>

#include "kilvo/map/voxel_index.hpp"

namespace kilvo {
namespace {

constexpr int half_width = 200;  // voxels
constexpr int wall_height = 25;
constexpr std::size_t lookups = 20000;

struct Keys {
  std::vector<VoxelKey> stored, scattered, sweep;
};

// A yard: ground of 400 x 400 voxels and a wall around it, 200 000 in all; seen from its middle.
Keys make_keys() {
  Keys k;
  for (int x = -half_width; x < half_width; ++x) {
    for (int y = -half_width; y < half_width; ++y) k.stored.push_back(pack_key(x, y, x / 40));
  }
  for (int a = -half_width; a < half_width; ++a) {
    for (int z = 0; z < wall_height; ++z) {
      for (const int side : {-half_width - 1, half_width}) {
        k.stored.push_back(pack_key(side, a, 20 + z));
        k.stored.push_back(pack_key(a, side, 20 + z));
      }
    }
  }
  std::mt19937_64 random(7);
  const auto in_map = [&](VoxelKey key) { return random() % 8 != 0 ? key : key ^ (VoxelKey{1} << 60); };
  for (std::size_t i = 0; i < lookups; ++i) k.scattered.push_back(in_map(k.stored[random() % k.stored.size()]));
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (std::size_t i = 0; i < lookups; ++i) {
    const double range = 1.2 / (0.01 + 0.5 * uniform(random)), azimuth = 2 * std::numbers::pi * static_cast<double>(i) / lookups;
    const int x = static_cast<int>(std::floor(range * std::cos(azimuth))), y = static_cast<int>(std::floor(range * std::sin(azimuth)));
    k.sweep.push_back(in_map(pack_key(x, y, x / 40)));
  }
  return k;
}

const Keys& keys() {
  static const Keys made = make_keys();
  return made;
}

// The packed key has its coordinates at its ends; a table that takes the low bits needs them mixed.
struct MixedHash {
  std::size_t operator()(VoxelKey key) const { return (key * 0x9E3779B97F4A7C15ULL) >> 32; }
};

struct Own {
  VoxelIndex map;
  void insert(VoxelKey key, std::uint32_t value) { map.insert(key, value); }
  std::uint32_t find(VoxelKey key) const { return map.find(key); }
};
template <class Map>
struct Library {
  Map map;
  void insert(VoxelKey key, std::uint32_t value) { map.emplace(key, value); }
  std::uint32_t find(VoxelKey key) const {
    const auto it = map.find(key);
    return it == map.end() ? no_index : it->second;
  }
};
using Robin = Library<tsl::robin_map<VoxelKey, std::uint32_t, MixedHash>>;
using Unordered = Library<std::unordered_map<VoxelKey, std::uint32_t, MixedHash>>;

template <class Index>
Index filled() {
  Index index;
  std::uint32_t value = 0;
  for (const VoxelKey key : keys().stored) index.insert(key, value++);
  return index;
}

template <class Index>
void look_up(benchmark::State& state, const std::vector<VoxelKey>& wanted) {
  static const Index index = filled<Index>();
  for (auto _ : state) {
    std::uint32_t sum = 0;
    for (const VoxelKey key : wanted) sum += index.find(key);
    benchmark::DoNotOptimize(sum);
  }
}

template <class Index>
void fill(benchmark::State& state) {
  for (auto _ : state) {
    Index index = filled<Index>();
    benchmark::DoNotOptimize(index);
  }
}

void lookup_scattered_own(benchmark::State& state) { look_up<Own>(state, keys().scattered); }
void lookup_scattered_robin_map(benchmark::State& state) { look_up<Robin>(state, keys().scattered); }
void lookup_scattered_unordered_map(benchmark::State& state) { look_up<Unordered>(state, keys().scattered); }
void lookup_sweep_own(benchmark::State& state) { look_up<Own>(state, keys().sweep); }
void lookup_sweep_robin_map(benchmark::State& state) { look_up<Robin>(state, keys().sweep); }
void lookup_sweep_unordered_map(benchmark::State& state) { look_up<Unordered>(state, keys().sweep); }
void fill_200k_own(benchmark::State& state) { fill<Own>(state); }
void fill_200k_robin_map(benchmark::State& state) { fill<Robin>(state); }
void fill_200k_unordered_map(benchmark::State& state) { fill<Unordered>(state); }
BENCHMARK(lookup_scattered_own);
BENCHMARK(lookup_scattered_robin_map);
BENCHMARK(lookup_scattered_unordered_map);
BENCHMARK(lookup_sweep_own);
BENCHMARK(lookup_sweep_robin_map);
BENCHMARK(lookup_sweep_unordered_map);
BENCHMARK(fill_200k_own);
BENCHMARK(fill_200k_robin_map);
BENCHMARK(fill_200k_unordered_map);

}  // namespace
}  // namespace kilvo
