// Point clouds as binary little-endian PLY: float x y z (m, world frame) and intensity; where images gave colour, uchar red green blue.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "kilvo/math/so3.hpp"
#include "lab/mapping/map_builder.hpp"
#include "lab/mapping/output_error.hpp"

namespace kilvo::lab {

/// Writes the whole map, in its order: the same map gives the same bytes. A map of which any point has a colour has red, green and blue;
/// points that no image saw are then grey by their intensity, so that what one looks at is whole. A file that was there stays whole until
/// the new one is complete (written beside it as PATH.partial, then renamed). `turn`: the points are turned by it. Throws OutputError.
void write_ply(const std::filesystem::path& path, const MapBuilder& map, const SO3& turn = SO3());

/// A file that is not a PLY as written here; the message names the path.
class PlyError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The points of a file: world frame, m. `intensity` and `rgb` are as long as `points_W`, or empty when the file has none.
struct Cloud {
  std::vector<Eigen::Vector3f> points_W;
  std::vector<float> intensity;
  std::vector<std::array<std::uint8_t, 3>> rgb;
};

/// Reads float x, y, z, intensity and uchar red, green, blue of a binary little-endian PLY with one element `vertex`; other float and uchar
/// properties are skipped. Throws PlyError.
Cloud read_cloud(const std::filesystem::path& path);

/// The same as x, y, z, intensity; a missing intensity is 0. Throws PlyError.
std::vector<Eigen::Vector4f> read_ply(const std::filesystem::path& path);

}  // namespace kilvo::lab
