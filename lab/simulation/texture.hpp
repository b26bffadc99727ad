// Procedural patterns with their smaller copies, so that what is far is seen averaged, as a lens and a pixel would average it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace kilvo::lab {

enum class Pattern : std::uint8_t { plain, rough, bricks, boards, tiles, poster };
inline constexpr int pattern_count = 6;

class Texture {
 public:
  Texture(Pattern pattern, std::uint64_t seed);

  /// Some of one copy and some of the next one.
  struct Blur {
    std::size_t level = 0;
    float next = 0;
  };
  /// What looks as if seen through a Gaussian of `sigma` metres on the surface.
  static Blur blur_of(double sigma);

  /// Equal steps on the surface, and how much each counts.
  struct Row {
    Eigen::Vector2d first, apart;    // m
    std::span<const float> weights;  // their sum is 1
  };
  /// Between 0 and 1; repeats every 4.1 m.
  float along(const Row& row, const Blur& blur) const;

 private:
  // Each with twice the blur's variance of the one before, every second half as wide. The last row and column and the first two come again
  // beyond the other end.
  std::vector<std::vector<float>> levels_;
  bool plain_ = false;
};

}  // namespace kilvo::lab
