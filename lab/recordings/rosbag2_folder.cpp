#include "lab/recordings/rosbag2_folder.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <yaml-cpp/yaml.h>

namespace kilvo::lab {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t most_metadata_bytes = 16 << 20;
constexpr std::size_t most_files = 100'000;

bool is_recording(const fs::path& path) {
  fs::path name = path.filename();
  if (name.extension() == ".zstd" || name.extension() == ".zst") name = name.stem();
  constexpr std::array<const char*, 3> endings{".mcap", ".db3", ".bag"};
  return std::ranges::any_of(endings, [&](const char* ending) { return name.extension() == ending; });
}

/// The names in metadata.yaml; empty when there are none or it cannot be read.
std::vector<std::string> names_in(const fs::path& metadata) {
  std::vector<std::string> names;
  std::error_code error;
  if (!fs::is_regular_file(metadata, error) || fs::file_size(metadata, error) > most_metadata_bytes) return names;
  std::ifstream file(metadata, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  try {
    const YAML::Node paths = YAML::Load(text)["rosbag2_bagfile_information"]["relative_file_paths"];
    if (!paths.IsSequence()) return names;
    for (const auto& path : paths) {
      if (names.size() < most_files) names.push_back(path.as<std::string>());
    }
  } catch (const YAML::Exception&) {
    names.clear();
  }
  return names;
}

}  // namespace

Rosbag2Folder find_rosbag2_files(const fs::path& folder) {
  Rosbag2Folder found;
  std::error_code error;
  for (const std::string& name : names_in(folder / "metadata.yaml")) {
    // Some versions write the folder's name too.
    fs::path path = folder / name;
    if (!fs::exists(path, error)) path = folder / fs::path(name).filename();
    if (!fs::exists(path, error) && fs::exists(path.string() + ".zstd", error)) path += ".zstd";
    if (fs::exists(path, error)) {
      found.files.push_back(path);
    } else {
      found.damages.push_back({0, "the file is missing that metadata.yaml names", path.string()});
    }
  }
  if (!found.files.empty()) return found;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (is_recording(at->path()) && found.files.size() < most_files) found.files.push_back(at->path());
  }
  std::ranges::sort(found.files);
  return found;
}

}  // namespace kilvo::lab
