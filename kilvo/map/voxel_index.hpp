// Open-addressing hash from voxel coordinates to a 32-bit index: packed 64-bit keys, linear probing, load at most one half,
// deletion by shifting back, so that no tombstones gather in a map that forgets.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace kilvo {

using VoxelKey = std::uint64_t;

/// Of each coordinate in a key: about +-1 million voxels.
inline constexpr int key_bits = 21;

/// Packs integer coordinates.
inline VoxelKey pack_key(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto low = [](std::int64_t v) { return static_cast<std::uint64_t>(v) & ((1ULL << key_bits) - 1); };
  return low(x) | low(y) << key_bits | low(z) << 2 * key_bits;
}
/// Its x, y or z (axis 0, 1, 2), with the sign.
inline std::int64_t coordinate_of(VoxelKey key, int axis) {
  return static_cast<std::int64_t>(key << (64 - (axis + 1) * key_bits)) >> (64 - key_bits);
}

/// floor() without a library call; |x| must be below 2^31.
inline std::int64_t fast_floor(double x) {
  const auto i = static_cast<std::int64_t>(x);
  return i - (x < static_cast<double>(i) ? 1 : 0);
}

/// Of no element.
inline constexpr std::uint32_t no_index = 0xffffffff;

class VoxelIndex {
 public:
  VoxelIndex() { resize(64); }

  std::size_t size() const { return size_; }
  std::size_t capacity() const { return slots_.size(); }

  std::uint32_t find(VoxelKey key) const {
    for (std::size_t i = home(key);; i = (i + 1) & mask_) {
      if (slots_[i].value == no_index) return no_index;
      if (slots_[i].key == key) return slots_[i].value;
    }
  }

  /// Begins to fetch what find(key) will read.
  void prefetch(VoxelKey key) const { __builtin_prefetch(&slots_[home(key)]); }

  /// The key must not be in the index.
  void insert(VoxelKey key, std::uint32_t value) {
    if (2 * (size_ + 1) > slots_.size()) resize(2 * slots_.size());
    place(key, value);
    ++size_;
  }

  void erase(VoxelKey key) {
    std::size_t i = home(key);
    while (slots_[i].value != no_index && slots_[i].key != key) i = (i + 1) & mask_;
    if (slots_[i].value == no_index) return;
    --size_;
    // Shift back every later member of the run whose home is not between the hole and itself.
    for (std::size_t j = (i + 1) & mask_; slots_[j].value != no_index; j = (j + 1) & mask_) {
      if (((j - home(slots_[j].key)) & mask_) >= ((j - i) & mask_)) {
        slots_[i] = slots_[j];
        i = j;
      }
    }
    slots_[i].value = no_index;
  }

 private:
  struct Slot {
    VoxelKey key = 0;
    std::uint32_t value = no_index;
  };

  std::size_t home(VoxelKey key) const { return (key * 0x9E3779B97F4A7C15ULL) >> shift_; }

  void place(VoxelKey key, std::uint32_t value) {
    std::size_t i = home(key);
    while (slots_[i].value != no_index) i = (i + 1) & mask_;
    slots_[i] = {key, value};
  }

  void resize(std::size_t capacity) {
    std::vector<Slot> old(capacity);
    old.swap(slots_);
    mask_ = capacity - 1;
    shift_ = 64;
    for (std::size_t c = capacity; c > 1; c >>= 1) --shift_;
    for (const Slot& s : old) {
      if (s.value != no_index) place(s.key, s.value);
    }
  }

  std::vector<Slot> slots_;
  std::size_t mask_ = 0, size_ = 0;
  int shift_ = 0;
};

}  // namespace kilvo
