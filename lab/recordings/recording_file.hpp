// What kind of recording is this?
#pragma once

#include <filesystem>
#include <memory>

#include "lab/recordings/file_bytes.hpp"
#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

/// INPUT as the user wrote it: a ROS 1 bag, an MCAP file, a .db3 of rosbag2, any of these compressed as a whole with zstd, or a folder:
/// with a `recording.bag`, or of rosbag2 (with `metadata.yaml` or without: its recordings are one). Known by content, not by name. Throws
/// InputError, which names the file, when it is missing, empty or no recording.
std::unique_ptr<RecordingReader> open_recording(const std::filesystem::path& input);

/// Several as one.
std::unique_ptr<RecordingReader> open_recordings(const std::vector<std::filesystem::path>& inputs);

/// The reader for a file by its content.
std::unique_ptr<RecordingReader> open_recording(FileBytes file);

}  // namespace kilvo::lab
