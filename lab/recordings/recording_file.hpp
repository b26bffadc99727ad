// What kind of recording is this?
#pragma once

#include "lab/recordings/rosbag1_reader.hpp"

namespace kilvo::lab {

/// INPUT as the user wrote it: a bag, or a folder with a `recording.bag` in it. Throws InputError, which names the file, when it is
/// missing, empty, no recording, or of a kind that is recognised but not read yet (.mcap, .db3).
Rosbag1Reader open_recording(const std::filesystem::path& input);

}  // namespace kilvo::lab
