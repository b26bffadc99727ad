// The files of a rosbag2 recording.
#pragma once

#include <filesystem>
#include <vector>

#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

struct Rosbag2Folder {
  std::vector<std::filesystem::path> files;
  std::vector<Damage> damages;  // files that metadata.yaml names and that are not there
};

/// Those that `metadata.yaml` names; without it, or where it cannot be read, every .mcap, .db3 and .bag (and these with .zstd) by name.
Rosbag2Folder find_rosbag2_files(const std::filesystem::path& folder);

}  // namespace kilvo::lab
