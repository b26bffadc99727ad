// The map a user keeps: every point the estimator saw in the world, thinned to one per voxel, also where the estimator has forgotten.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "kilvo/estimator/output.hpp"
#include "kilvo/math/field.hpp"

namespace kilvo::lab {

struct MappingConfig {
  double resolution = 0.05;  // m
  bool keep = true;
  int max_points = 20000000;

  static constexpr auto fields() {
    return std::tuple{
        Field{"resolution", &MappingConfig::resolution, "m", "edge of the voxels of which the saved map keeps one point each"},
        Field{"keep", &MappingConfig::keep, "-", "whether a map is kept to be saved at all"},
        Field{"max_points", &MappingConfig::max_points, "-",
              "points of the saved map at most (about 42 bytes each); what is seen beyond them is left out"}};
  }
};

/// One point per voxel: the mean of the first 32 that fell into it. A mean is smoother than the first point (walls get thinner than the
/// LiDAR's noise), and because it is then left alone, a later pass that has drifted neither blurs nor moves what is there. The result
/// depends on the points and their order only. Memory: 24 bytes per point kept, about 10 for finding it and 8 for its colour where images
/// have been; it grows in small pieces, so that no call waits long for it and the old and the new never lie side by side.
class MapBuilder {
 public:
  /// Throws std::invalid_argument when the resolution is not a positive length.
  explicit MapBuilder(const MappingConfig& config = {});

  /// Adds points (x, y, z in the world frame, m; intensity). Points with a non-finite number, and those 2^20 voxels (52 km at 0.05 m) or
  /// more from the origin along an axis, are dropped and counted.
  void add(std::span<const Eigen::Vector4f> points_W);

  /// Gives colour to the points whose voxels these fall into; where the map has no point there is nothing to colour. A point's colour is
  /// the mean by weight of those given, until these weigh 64 times as much as the next one: from there on newer ones count no less.
  /// Weights are taken between 1e-6 and 1e6; a point with a weight that is not positive is ignored.
  void colour(std::span<const ColouredPoint> points);

  /// How many points the map has.
  std::size_t size() const { return size_; }
  /// Point i (x, y, z, intensity), in the order in which their voxels were first hit. i < size().
  Eigen::Vector4f point(std::size_t i) const;
  /// The colour of point i; none when no image has seen it. i < size().
  std::optional<std::array<std::uint8_t, 3>> colour_of(std::size_t i) const;
  /// How many points have a colour.
  std::size_t coloured() const { return coloured_; }
  /// How many of the points given to add() were left out because the map was full.
  std::uint64_t left_out() const { return left_out_; }
  /// How many of the points given to add() were not usable.
  std::uint64_t dropped() const { return dropped_; }
  /// What the map occupies.
  std::size_t memory_bytes() const;

 private:
  static constexpr std::size_t chunk_size = 32768;  // voxels

  struct Voxel {
    std::uint64_t key;          // three indices of 21 bits
    std::uint16_t position[3];  // the mean within the voxel, in 1/65536 of its edge
    std::uint16_t count;        // points in the mean
    float intensity;            // their mean
  };

  struct Colour {
    std::uint16_t rgb[3];  // in 1/256
    std::uint16_t weight;  // of the mean: the upper half of a float; 0 without colour
  };

  /// Open addressing: number of a voxel + 1, 0 where empty. The bits that no number needs hold some of the hash, so that other voxels on
  /// the way need not be looked at.
  struct Table {
    std::vector<std::uint32_t> slots;
    std::size_t used = 0;
    std::size_t limit = 0;  // of `used`
    int shift = 64;         // a hash >> shift is a slot
  };

  /// Points on their way, so many at a time that their cache misses overlap.
  struct Block;
  std::size_t locate(const Eigen::Vector4f* points_W, std::size_t count, Block& block) const;
  std::size_t leave_out_full(Block& block, std::size_t count) const;
  void prefetch(Block& block, std::size_t count) const;
  std::uint32_t tag_of(std::uint64_t hashed) const { return static_cast<std::uint32_t>(hashed >> 8U << number_bits_); }
  std::uint32_t number_mask() const { return (std::uint32_t{1} << number_bits_) - 1; }
  std::size_t slot_of(const Table& table, std::uint64_t key, std::uint64_t hashed, std::size_t place) const;
  void merge(const Voxel& sample, std::uint64_t hashed, std::size_t from);
  void mix(const ColouredPoint& point, Colour& known);
  void append(const Voxel& sample);
  void grow(Table& table);
  const Voxel& voxel(std::size_t i) const { return chunks_[i / chunk_size][i % chunk_size]; }
  Voxel& voxel(std::size_t i) { return chunks_[i / chunk_size][i % chunk_size]; }
  Colour& colour_at(std::size_t i);

  double resolution_;
  bool keep_;
  std::size_t max_points_;
  unsigned number_bits_;   // of a slot
  std::size_t grown_ = 0;  // how many times a table grew
  std::size_t size_ = 0;
  std::size_t coloured_ = 0;
  std::uint64_t dropped_ = 0, left_out_ = 0;
  std::vector<std::unique_ptr<Voxel[]>> chunks_;    // never moved
  std::vector<std::unique_ptr<Colour[]>> colours_;  // of the chunks; null, or missing, where nothing has a colour
  std::vector<Table> tables_;                       // many small ones, grown one at a time
  std::vector<std::uint64_t> full_;                 // by hash, the last key whose mean is complete: nothing changes there any more
};

}  // namespace kilvo::lab
