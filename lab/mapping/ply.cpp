#include "lab/mapping/ply.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

namespace kilvo::lab {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string header(std::size_t points) {
  return "ply\nformat binary_little_endian 1.0\ncomment KILVO map: metres, world frame\nelement vertex " + std::to_string(points) +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\nend_header\n";
}

bool write_all(std::FILE* file, const void* data, std::size_t bytes) { return std::fwrite(data, 1, bytes, file) == bytes; }

bool write_map(const fs::path& path, const MapBuilder& map) {
  File file(std::fopen(path.c_str(), "wb"), std::fclose);
  if (!file) return false;
  const std::string head = header(map.size());
  if (!write_all(file.get(), head.data(), head.size())) return false;
  std::array<Eigen::Vector4f, 4096> buffer;
  for (std::size_t begin = 0; begin < map.size(); begin += buffer.size()) {
    const std::size_t count = std::min(buffer.size(), map.size() - begin);
    for (std::size_t i = 0; i < count; ++i) buffer[i] = map.point(begin + i);
    if (!write_all(file.get(), buffer.data(), count * sizeof(buffer[0]))) return false;
  }
  return std::fclose(file.release()) == 0;
}

struct Property {
  std::string_view name;
  std::string_view type;
};
constexpr std::array<Property, 7> known_properties = {
    {{"x", "float"}, {"y", "float"}, {"z", "float"}, {"intensity", "float"}, {"red", "uchar"}, {"green", "uchar"}, {"blue", "uchar"}}};

/// Where each of the known properties begins in a vertex, and how long a vertex is.
struct Layout {
  std::size_t points = 0;
  std::size_t stride = 0;
  std::array<std::optional<std::size_t>, known_properties.size()> offsets;

  bool has_intensity() const { return offsets[3].has_value(); }
  bool has_rgb() const { return offsets[4] && offsets[5] && offsets[6]; }
};

Layout read_header(std::istream& in, const std::string& path) {
  const auto fail = [&](const std::string& why) { throw PlyError(path + ": " + why); };
  Layout layout;
  std::string line, word, type, name;
  if (!std::getline(in, line) || line != "ply") fail("not a PLY file");
  if (!std::getline(in, line) || line != "format binary_little_endian 1.0") fail("not a binary little-endian PLY");
  while (std::getline(in, line) && line != "end_header") {
    std::istringstream words(line);
    words >> word;
    if (word == "comment") continue;
    if (word == "element" && layout.stride == 0 && words >> name >> layout.points && name == "vertex") continue;
    if (word != "property" || !(words >> type >> name) || (type != "float" && type != "uchar")) fail("cannot read '" + line + "'");
    for (std::size_t i = 0; i < known_properties.size(); ++i)
      if (known_properties[i].name == name && known_properties[i].type == type) layout.offsets[i] = layout.stride;
    layout.stride += type == "float" ? 4 : 1;
  }
  if (!in) fail("the header has no end");
  if (!layout.offsets[0] || !layout.offsets[1] || !layout.offsets[2]) fail("no float x, y, z");
  return layout;
}

/// Copies what is known of one vertex.
void append_vertex(const std::vector<char>& vertex, const Layout& layout, Cloud& cloud) {
  const auto copy = [&](std::size_t property, auto& value) {
    std::memcpy(&value, vertex.data() + *layout.offsets[property], sizeof(value));
  };
  Eigen::Vector3f& p = cloud.points_W.emplace_back();
  for (std::size_t i = 0; i < 3; ++i) copy(i, p[static_cast<Eigen::Index>(i)]);
  if (layout.has_intensity()) copy(3, cloud.intensity.emplace_back());
  if (!layout.has_rgb()) return;
  auto& rgb = cloud.rgb.emplace_back();
  for (std::size_t i = 0; i < 3; ++i) copy(4 + i, rgb[i]);
}

}  // namespace

void write_ply(const fs::path& path, const MapBuilder& map) {
  std::error_code error;
  // A device or a pipe is written to, never replaced; a link is followed.
  const bool special = fs::exists(path, error) && !fs::is_regular_file(path, error);
  const fs::path target = fs::exists(path, error) ? fs::canonical(path, error) : path;
  const fs::path partial = special ? path : fs::path(target.string() + ".partial");
  errno = 0;
  bool done = write_map(partial, map);
  if (done && !special) done = std::rename(partial.c_str(), target.c_str()) == 0;
  if (done) return;
  const std::string reason = std::strerror(errno);
  if (!special) fs::remove(partial, error);
  throw OutputError("cannot write " + path.string() + ": " + reason);
}

Cloud read_cloud(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw PlyError("cannot open " + path.string());
  const Layout layout = read_header(in, path.string());
  Cloud cloud;
  std::vector<char> vertex(layout.stride);
  while (cloud.points_W.size() < layout.points && in.read(vertex.data(), static_cast<std::streamsize>(vertex.size()))) {
    append_vertex(vertex, layout, cloud);
  }
  if (cloud.points_W.size() < layout.points)
    throw PlyError(path.string() + ": ends after " + std::to_string(cloud.points_W.size()) + " points");
  return cloud;
}

std::vector<Eigen::Vector4f> read_ply(const fs::path& path) {
  const Cloud cloud = read_cloud(path);
  std::vector<Eigen::Vector4f> points;
  points.reserve(cloud.points_W.size());
  for (std::size_t i = 0; i < cloud.points_W.size(); ++i) {
    const Eigen::Vector3f& p = cloud.points_W[i];
    points.emplace_back(p.x(), p.y(), p.z(), cloud.intensity.empty() ? 0.0F : cloud.intensity[i]);
  }
  return points;
}

}  // namespace kilvo::lab
