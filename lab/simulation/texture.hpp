// Procedural patterns with their smaller copies, so that what is far is seen averaged, as a lens and a pixel would average it.
#pragma once

#include <cstdint>
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

  /// Between 0 and 1 at (u, v), in metres on the surface; repeats every 4.1 m.
  float at(double u, double v, const Blur& blur) const;

 private:
  float spline(std::size_t level, double x, double y) const;

  // Each with twice the blur's variance of the one before, every second half as wide; three columns come again at the end of each row.
  std::vector<std::vector<float>> levels_;
};

}  // namespace kilvo::lab
