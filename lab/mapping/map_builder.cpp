#include "lab/mapping/map_builder.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <stdexcept>

namespace kilvo::lab {
namespace {

constexpr int chunk_bits = 15;
constexpr std::size_t chunk_size = std::size_t{1} << chunk_bits;
constexpr int first_table_bits = 12;
constexpr double largest_load = 0.65;  // fuller costs probes, each a cache miss; emptier costs memory
constexpr int axis_bits = 21;
constexpr std::uint64_t axis_mask = (std::uint64_t{1} << axis_bits) - 1;
constexpr double axis_offset = 1 << (axis_bits - 1);
constexpr double fractions = 65536;
constexpr std::uint16_t most_averaged = 32;
constexpr std::size_t block_size = 32;  // points on their way at a time, so that their cache misses overlap

/// Spreads neighbouring voxels over all 64 bits (the finaliser of MurmurHash3).
std::uint64_t hash(std::uint64_t key) {
  key = (key ^ (key >> 33)) * 0xff51afd7ed558ccdULL;
  key = (key ^ (key >> 33)) * 0xc4ceb9fe1a85ec53ULL;
  return key ^ (key >> 33);
}

std::uint16_t moved(std::uint16_t mean, std::uint16_t towards, float share) {
  const float from = mean;
  return static_cast<std::uint16_t>(std::lrint(from + share * (static_cast<float>(towards) - from)));
}

}  // namespace

MapBuilder::MapBuilder(const MappingConfig& config)
    : resolution_(config.resolution), table_(std::size_t{1} << first_table_bits), shift_(64 - first_table_bits) {
  if (!(std::isfinite(resolution_) && resolution_ > 0)) throw std::invalid_argument("map.resolution must be a positive length in metres");
}

void MapBuilder::add(std::span<const Eigen::Vector4f> points_W) {
  std::array<Voxel, block_size> samples;
  std::array<std::size_t, block_size> places;
  for (std::size_t begin = 0; begin < points_W.size(); begin += block_size) {
    const auto block = points_W.subspan(begin, std::min(block_size, points_W.size() - begin));
    if (static_cast<double>(size_ + block_size) > largest_load * static_cast<double>(table_.size())) grow_table();
    std::size_t count = 0;
    for (const Eigen::Vector4f& point : block) {
      if (!locate(point, samples[count])) continue;
      places[count] = place_of(samples[count].key);
      __builtin_prefetch(&table_[places[count]]);
      ++count;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t number = table_[places[i]];
      if (number != 0) __builtin_prefetch(&voxel(number - 1));
    }
    for (std::size_t i = 0; i < count; ++i) merge(samples[i], places[i]);
    dropped_ += block.size() - count;
  }
}

/// The voxel that holds this point alone; false when there is none.
bool MapBuilder::locate(const Eigen::Vector4f& point_W, Voxel& sample) const {
  if (!std::isfinite(point_W[3])) return false;
  sample.key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double x = static_cast<double>(point_W[axis]) / resolution_ + axis_offset;
    if (!(x >= 0 && x < 2 * axis_offset)) return false;  // also when it is not a number
    const auto index = static_cast<std::uint64_t>(x);
    sample.key |= index << (axis * axis_bits);
    sample.position[axis] = static_cast<std::uint16_t>((x - static_cast<double>(index)) * fractions);
  }
  sample.count = 1;
  sample.intensity = point_W[3];
  return true;
}

void MapBuilder::merge(const Voxel& sample, std::size_t place) {
  for (; table_[place] != 0; place = (place + 1) & (table_.size() - 1)) {
    Voxel& known = chunks_[(table_[place] - 1) >> chunk_bits][(table_[place] - 1) & (chunk_size - 1)];
    if (known.key != sample.key) continue;
    if (known.count == most_averaged) return;
    ++known.count;
    const float share = 1.0F / static_cast<float>(known.count);
    for (int axis = 0; axis < 3; ++axis) known.position[axis] = moved(known.position[axis], sample.position[axis], share);
    known.intensity += share * (sample.intensity - known.intensity);
    return;
  }
  append(sample);
  table_[place] = static_cast<std::uint32_t>(size_);
}

void MapBuilder::append(const Voxel& sample) {
  if ((size_ & (chunk_size - 1)) == 0) chunks_.push_back(std::make_unique_for_overwrite<Voxel[]>(chunk_size));
  chunks_.back()[size_ & (chunk_size - 1)] = sample;
  ++size_;
}

void MapBuilder::grow_table() {
  const std::size_t wanted = 2 * table_.size();
  table_ = std::vector<std::uint32_t>();  // first, so that old and new never exist together: the voxels know their keys
  table_.resize(wanted);
  --shift_;
  for (std::size_t i = 0; i < size_; ++i) {
    std::size_t place = place_of(voxel(i).key);
    while (table_[place] != 0) place = (place + 1) & (table_.size() - 1);
    table_[place] = static_cast<std::uint32_t>(i + 1);
  }
}

std::size_t MapBuilder::place_of(std::uint64_t key) const { return hash(key) >> shift_; }

const MapBuilder::Voxel& MapBuilder::voxel(std::size_t i) const { return chunks_[i >> chunk_bits][i & (chunk_size - 1)]; }

Eigen::Vector4f MapBuilder::point(std::size_t i) const {
  assert(i < size_);
  const Voxel& v = voxel(i);
  Eigen::Vector4f point_W;
  for (int axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<double>((v.key >> (axis * axis_bits)) & axis_mask);
    point_W[axis] = static_cast<float>((index - axis_offset + (v.position[axis] + 0.5) / fractions) * resolution_);
  }
  point_W[3] = v.intensity;
  return point_W;
}

std::size_t MapBuilder::memory_bytes() const {
  return sizeof(*this) + chunks_.size() * chunk_size * sizeof(Voxel) + chunks_.capacity() * sizeof(chunks_[0]) +
         table_.capacity() * sizeof(table_[0]);
}

}  // namespace kilvo::lab
