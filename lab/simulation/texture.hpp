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

  /// Which copy is the right one for a pixel that sees `footprint` metres of the surface; between two of them: some of both.
  static double level_for(double footprint);

  /// Between 0 and 1 at (u, v), in metres on the surface; repeats every 4.1 m.
  double at(double u, double v, double level) const;

 private:
  double bilinear(std::size_t level, double x, double y) const;

  std::vector<std::vector<std::uint8_t>> levels_;  // each half as wide as the one before
};

}  // namespace kilvo::lab
