#include "lab/mapping/map_builder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace kilvo::lab {
namespace {

constexpr std::size_t table_count = 256;
constexpr std::size_t first_slots = 16;
constexpr int axis_bits = 21;
constexpr std::uint64_t axis_mask = (std::uint64_t{1} << axis_bits) - 1;
constexpr double axis_offset = 1 << (axis_bits - 1);
constexpr double fractions = 65536;
constexpr std::uint16_t most_averaged = 32;
constexpr float most_remembered = 64;  // as heavy as so many of the next colour; more would be lost in the rounding of the mean
constexpr float least_weight = 1e-6F, most_weight = 1e6F;
constexpr std::size_t block_size = 32;
constexpr std::size_t full_known = 1 << 16;          // half a megabyte, which stays in a core's own cache
constexpr std::uint64_t no_key = ~std::uint64_t{0};  // has 64 bits; keys have 63

/// Spreads neighbouring voxels over all 64 bits (the finaliser of MurmurHash3).
std::uint64_t hash(std::uint64_t key) {
  key = (key ^ (key >> 33)) * 0xff51afd7ed558ccdULL;
  key = (key ^ (key >> 33)) * 0xc4ceb9fe1a85ec53ULL;
  return key ^ (key >> 33);
}

/// How full table i may be. Fuller costs probes, each a cache miss; emptier costs memory. No two tables have the same, lest all of them,
/// which fill evenly, grow in the same call.
double largest_load(std::size_t i) { return 0.5 + 0.2 * static_cast<double>(i) / table_count; }

std::uint16_t moved(std::uint16_t mean, std::uint16_t towards, float share) {
  const float from = mean;
  return static_cast<std::uint16_t>(std::lrint(from + share * (static_cast<float>(towards) - from)));
}

/// A positive float in 16 bits: its exponent and the first bits of its fraction, rounded.
std::uint16_t upper_half(float x) { return static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(x) + 0x8000U) >> 16U); }

float from_upper_half(std::uint16_t half) { return std::bit_cast<float>(static_cast<std::uint32_t>(half) << 16U); }

// Where points lie: their voxels along the three axes and how far in.
struct Places {
  alignas(32) std::array<std::array<std::int32_t, block_size>, 3> index, within;
  alignas(32) std::array<std::int32_t, block_size> usable;
};

KILVO_WIDE void place_all(const float* points_W, std::size_t count, double resolution, Places& out) {
  out.usable.fill(1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < count; ++i) {
      const double at = static_cast<double>(points_W[4 * i + axis]) / resolution + axis_offset;
      const bool inside = at >= 0 && at < 2 * axis_offset;  // false when it is not a number
      const double x = inside ? at : 0;
      const auto index = static_cast<std::int32_t>(x);
      out.index[axis][i] = index;
      out.within[axis][i] = static_cast<std::int32_t>((x - static_cast<double>(index)) * fractions);
      out.usable[i] &= inside ? 1 : 0;
    }
  }
}

}  // namespace

MapBuilder::MapBuilder(const MappingConfig& config)
    : resolution_(config.resolution),
      keep_(config.keep),
      max_points_(static_cast<std::size_t>(std::max(0, config.max_points))),
      number_bits_(static_cast<unsigned>(std::bit_width(max_points_ + 1))),
      tables_(table_count),
      full_(full_known, no_key) {
  if (!(std::isfinite(resolution_) && resolution_ > 0)) throw std::invalid_argument("map.resolution must be a positive length in metres");
  for (Table& table : tables_) grow(table);
}

struct MapBuilder::Block {
  std::array<Voxel, block_size> samples;
  std::array<std::uint64_t, block_size> hashes;
  std::array<std::uint32_t, block_size> from;  // of which point
  std::array<std::size_t, block_size> places;  // in their tables: the voxel is there or farther on, unless the table grows
};

void MapBuilder::add(std::span<const Eigen::Vector4f> points_W) {
  if (!keep_) return;
  Block block;
  for (std::size_t begin = 0; begin < points_W.size(); begin += block_size) {
    const std::size_t size = std::min(block_size, points_W.size() - begin), located = locate(&points_W[begin], size, block);
    const std::size_t count = leave_out_full(block, located);
    prefetch(block, count);
    const std::size_t grown = grown_;
    for (std::size_t i = 0; i < count; ++i) {
      const Table& table = tables_[block.hashes[i] % table_count];
      merge(block.samples[i], block.hashes[i], grown_ == grown ? block.places[i] : block.hashes[i] >> table.shift);
    }
    dropped_ += size - located;
  }
}

/// Most points of a walk fall where the mean is complete. How many are left.
std::size_t MapBuilder::leave_out_full(Block& block, std::size_t count) const {
  std::size_t left = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (full_[block.hashes[i] % full_known] == block.samples[i].key) continue;
    block.samples[left] = block.samples[i];
    block.hashes[left] = block.hashes[i];
    ++left;
  }
  return left;
}

/// The voxels that hold each of these points alone; how many, since for some there is none.
std::size_t MapBuilder::locate(const Eigen::Vector4f* points_W, std::size_t count, Block& block) const {
  Places places;
  place_all(points_W->data(), count, resolution_, places);
  std::size_t located = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (places.usable[i] == 0 || !std::isfinite(points_W[i][3])) continue;
    Voxel& sample = block.samples[located];
    sample.key = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sample.key |= static_cast<std::uint64_t>(places.index[axis][i]) << (axis * axis_bits);
      sample.position[axis] = static_cast<std::uint16_t>(places.within[axis][i]);
    }
    sample.count = 1;
    sample.intensity = points_W[i][3];
    block.hashes[located] = hash(sample.key);
    block.from[located] = static_cast<std::uint32_t>(i);
    ++located;
  }
  return located;
}

/// Asks for the tables' slots of these, and for the voxels that they seem to have there.
void MapBuilder::prefetch(Block& block, std::size_t count) const {
  for (std::size_t i = 0; i < count; ++i) {
    const Table& table = tables_[block.hashes[i] % table_count];
    __builtin_prefetch(&table.slots[block.hashes[i] >> table.shift]);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Table& table = tables_[block.hashes[i] % table_count];
    const std::uint32_t tag = tag_of(block.hashes[i]);
    std::size_t place = block.hashes[i] >> table.shift;
    while (table.slots[place] != 0 && (table.slots[place] & ~number_mask()) != tag) place = (place + 1) & (table.slots.size() - 1);
    if (table.slots[place] != 0) __builtin_prefetch(&voxel((table.slots[place] & number_mask()) - 1));
    block.places[i] = place;
  }
}

/// Where the table has the voxel of this key, or is empty when it has none; `place`: not before.
std::size_t MapBuilder::slot_of(const Table& table, std::uint64_t key, std::uint64_t hashed, std::size_t place) const {
  const std::uint32_t tag = tag_of(hashed);
  for (;; place = (place + 1) & (table.slots.size() - 1)) {
    const std::uint32_t slot = table.slots[place];
    if (slot == 0 || ((slot & ~number_mask()) == tag && voxel((slot & number_mask()) - 1).key == key)) return place;
  }
}

void MapBuilder::merge(const Voxel& sample, std::uint64_t hashed, std::size_t from) {
  Table& table = tables_[hashed % table_count];
  const std::size_t place = slot_of(table, sample.key, hashed, from);
  if (table.slots[place] != 0) {
    Voxel& known = voxel((table.slots[place] & number_mask()) - 1);
    if (known.count == most_averaged) {
      full_[hashed % full_known] = known.key;
      return;
    }
    ++known.count;
    const float share = 1.0F / static_cast<float>(known.count);
    for (int axis = 0; axis < 3; ++axis) known.position[axis] = moved(known.position[axis], sample.position[axis], share);
    known.intensity += share * (sample.intensity - known.intensity);
    return;
  }
  if (size_ >= max_points_) {
    ++left_out_;
    return;
  }
  append(sample);
  table.slots[place] = tag_of(hashed) | static_cast<std::uint32_t>(size_);
  if (++table.used > table.limit) grow(table);
}

void MapBuilder::colour(std::span<const ColouredPoint> points) {
  Block block;
  std::array<Eigen::Vector4f, block_size> places;
  for (std::size_t begin = 0; begin < points.size(); begin += block_size) {
    const auto some = points.subspan(begin, std::min(block_size, points.size() - begin));
    for (std::size_t i = 0; i < some.size(); ++i) places[i] = some[i].p_W.homogeneous();
    const std::size_t count = locate(places.data(), some.size(), block);
    prefetch(block, count);
    for (std::size_t i = 0; i < count; ++i) {
      const ColouredPoint& point = some[block.from[i]];
      if (!(point.weight > 0)) continue;
      const Table& table = tables_[block.hashes[i] % table_count];
      const std::uint32_t slot = table.slots[slot_of(table, block.samples[i].key, block.hashes[i], block.places[i])];
      if (slot != 0) mix(point, colour_at((slot & number_mask()) - 1));
    }
  }
}

void MapBuilder::mix(const ColouredPoint& point, Colour& known) {
  const float weight = std::clamp(point.weight, least_weight, most_weight), before = from_upper_half(known.weight);
  if (known.weight == 0) ++coloured_;
  const float share = weight / (before + weight);
  for (std::size_t i = 0; i < 3; ++i) known.rgb[i] = moved(known.rgb[i], static_cast<std::uint16_t>(256 * point.rgb[i]), share);
  known.weight = upper_half(std::max(before, std::min(before + weight, most_remembered * weight)));
}

void MapBuilder::append(const Voxel& sample) {
  if (size_ % chunk_size == 0) chunks_.push_back(std::make_unique_for_overwrite<Voxel[]>(chunk_size));
  chunks_.back()[size_ % chunk_size] = sample;
  ++size_;
}

void MapBuilder::grow(Table& table) {
  ++grown_;
  const std::vector<std::uint32_t> old = std::move(table.slots);
  const std::size_t slots = std::max(first_slots, 2 * old.size());
  table.slots.assign(slots, 0);
  table.shift = 64 - std::countr_zero(slots);
  table.limit = static_cast<std::size_t>(largest_load(static_cast<std::size_t>(&table - tables_.data())) * static_cast<double>(slots));
  for (const std::uint32_t slot : old) {
    if (slot == 0) continue;
    std::size_t place = hash(voxel((slot & number_mask()) - 1).key) >> table.shift;
    while (table.slots[place] != 0) place = (place + 1) & (slots - 1);
    table.slots[place] = slot;
  }
}

MapBuilder::Colour& MapBuilder::colour_at(std::size_t i) {
  const std::size_t chunk = i / chunk_size;
  if (chunk >= colours_.size()) colours_.resize(chunk + 1);
  if (!colours_[chunk]) colours_[chunk] = std::make_unique<Colour[]>(chunk_size);  // all zero: without colour
  return colours_[chunk][i % chunk_size];
}

std::optional<std::array<std::uint8_t, 3>> MapBuilder::colour_of(std::size_t i) const {
  assert(i < size_);
  const std::size_t chunk = i / chunk_size;
  if (chunk >= colours_.size() || !colours_[chunk]) return std::nullopt;
  const Colour& known = colours_[chunk][i % chunk_size];
  if (known.weight == 0) return std::nullopt;
  std::array<std::uint8_t, 3> out{};
  for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<std::uint8_t>((known.rgb[k] + 128) / 256);  // at most 255
  return out;
}

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
  std::size_t bytes =
      sizeof(*this) + chunks_.size() * chunk_size * sizeof(Voxel) + tables_.size() * sizeof(Table) + full_.size() * sizeof(std::uint64_t);
  for (const Table& table : tables_) bytes += table.slots.capacity() * sizeof(std::uint32_t);
  for (const auto& chunk : colours_) bytes += sizeof(chunk) + (chunk ? chunk_size * sizeof(Colour) : 0);
  return bytes;
}

}  // namespace kilvo::lab
