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

std::string header(const MapBuilder& map) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment KILVO map: metres, world frame\n";
  if (map.coloured() > 0) out += "comment grey: not seen by the camera\n";
  out +=
      "element vertex " + std::to_string(map.size()) + "\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\n";
  if (map.coloured() > 0) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  return out + "end_header\n";
}

/// Greys for intensities, whatever their scale is: dark and light at the 1st and the 99th percentile of about 100 000 of the points.
class Greys {
 public:
  explicit Greys(const MapBuilder& map) {
    std::vector<float> some;
    const std::size_t step = map.size() / 100000 + 1;
    for (std::size_t i = 0; i < map.size(); i += step) some.push_back(map.point(i)[3]);
    std::sort(some.begin(), some.end());
    low_ = some[some.size() / 100];
    span_ = some[some.size() - 1 - some.size() / 100] - low_;
  }

  std::uint8_t of(float intensity) const {
    constexpr float dark = 50, light = 200;
    if (!(span_ > 0)) return (dark + light) / 2;
    return static_cast<std::uint8_t>(dark + (light - dark) * std::clamp((intensity - low_) / span_, 0.0F, 1.0F));
  }

 private:
  float low_, span_;
};

using Vertex = std::array<char, sizeof(Eigen::Vector4f) + 3>;

/// Where the points lie in the world that is written.
class Turned {
 public:
  Turned(const MapBuilder& map, const SO3& turn) : map_(map), R_(turn.matrix().cast<float>()) {}
  Eigen::Vector4f operator()(std::size_t i) const {
    Eigen::Vector4f point = map_.point(i);
    point.head<3>() = (R_ * point.head<3>()).eval();
    return point;
  }

 private:
  const MapBuilder& map_;
  Eigen::Matrix3f R_;
};

Vertex coloured_vertex(const MapBuilder& map, const Turned& turned, std::size_t i, const Greys& greys) {
  const Eigen::Vector4f point = turned(i);
  auto rgb = map.colour_of(i);
  if (!rgb) {
    const std::uint8_t grey = greys.of(point[3]);
    rgb = {grey, grey, grey};
  }
  Vertex out;
  std::memcpy(out.data(), point.data(), sizeof(point));
  std::memcpy(out.data() + sizeof(point), rgb->data(), rgb->size());
  return out;
}

bool write_all(std::FILE* file, const void* data, std::size_t bytes) { return std::fwrite(data, 1, bytes, file) == bytes; }

/// Vertices 0 to `size`, a few thousand at a time.
template <class Make>
bool write_vertices(std::FILE* file, std::size_t size, const Make& make) {
  std::array<decltype(make(std::size_t{})), 4096> buffer;
  for (std::size_t begin = 0; begin < size; begin += buffer.size()) {
    const std::size_t count = std::min(buffer.size(), size - begin);
    for (std::size_t i = 0; i < count; ++i) buffer[i] = make(begin + i);
    if (!write_all(file, buffer.data(), count * sizeof(buffer[0]))) return false;
  }
  return true;
}

bool write_points(std::FILE* file, const MapBuilder& map, const SO3& turn) {
  const Turned turned(map, turn);
  if (map.coloured() == 0) return write_vertices(file, map.size(), turned);
  return write_vertices(file, map.size(), [&, greys = Greys(map)](std::size_t i) { return coloured_vertex(map, turned, i, greys); });
}

bool write_map(const fs::path& path, const MapBuilder& map, const SO3& turn) {
  File file(std::fopen(path.c_str(), "wb"), std::fclose);
  if (!file) return false;
  const std::string head = header(map);
  if (!write_all(file.get(), head.data(), head.size()) || !write_points(file.get(), map, turn)) return false;
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

void write_ply(const fs::path& path, const MapBuilder& map, const SO3& turn) {
  std::error_code error;
  // A device or a pipe is written to, never replaced; a link is followed.
  const bool special = fs::exists(path, error) && !fs::is_regular_file(path, error);
  const fs::path target = fs::exists(path, error) ? fs::canonical(path, error) : path;
  const fs::path partial = special ? path : fs::path(target.string() + ".partial");
  errno = 0;
  bool done = write_map(partial, map, turn);
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
