#include "lab/recordings/recording_file.hpp"

#include <algorithm>
#include <array>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/db3_reader.hpp"
#include "lab/recordings/inflated_file.hpp"
#include "lab/recordings/joined_reader.hpp"
#include "lab/recordings/mcap_reader.hpp"
#include "lab/recordings/rosbag1_reader.hpp"
#include "lab/recordings/rosbag2_folder.hpp"

namespace kilvo::lab {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

/// The reader, and the name of what lies within the compressed file where it is one.
std::unique_ptr<RecordingReader> open_inflated(const FileBytes& compressed) {
  InflatedFile inflated = inflate_file(compressed);
  std::vector<Damage> damages;
  if (inflated.damage) damages.push_back({inflated.damage->offset, inflated.damage->reason, compressed.name()});
  if (is_zstd_file(inflated.file)) throw InputError(compressed.name() + ": compressed more than once");
  std::vector<std::unique_ptr<RecordingReader>> parts;
  parts.push_back(open_recording(std::move(inflated.file)));
  return std::make_unique<JoinedReader>(compressed.name(), std::move(parts), std::move(damages));
}

std::unique_ptr<RecordingReader> open_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "recording.bag", error)) return open_recording(FileBytes(folder / "recording.bag"));
  Rosbag2Folder content = find_rosbag2_files(folder);
  if (content.files.empty())
    throw InputError(folder.string() + ": the folder has no recording.bag and no recording of rosbag2 (.mcap, .db3)");
  std::vector<std::unique_ptr<RecordingReader>> parts;
  for (const fs::path& file : content.files) {
    try {
      parts.push_back(open_recording(file));
    } catch (const InputError& unusable) {
      if (content.files.size() == 1) throw;
      content.damages.push_back({0, unusable.what(), file.string()});
    }
  }
  if (parts.empty()) throw InputError(folder.string() + ": none of its recordings can be read: " + content.damages.front().reason);
  return std::make_unique<JoinedReader>(folder.string(), std::move(parts), std::move(content.damages));
}

}  // namespace

std::unique_ptr<RecordingReader> open_recording(FileBytes file) {
  std::array<std::uint8_t, 16> begin{};
  const std::string_view text = as_text(Bytes(begin).first(file.read_at(0, begin)));
  if (is_zstd_file(file)) return open_inflated(file);
  if (text.starts_with(mcap_magic)) return std::make_unique<McapReader>(std::move(file));
  if (text.starts_with("SQLite format 3\0"sv)) return std::make_unique<Db3Reader>(std::move(file));
  if (file.size() == 0) throw InputError(file.name() + ": the file is empty");
  if (!text.starts_with("#ROSBAG V")) throw InputError(file.name() + ": not a recording (a ROS 1 bag, MCAP, or rosbag2's .db3)");
  return std::make_unique<Rosbag1Reader>(std::move(file));
}

std::unique_ptr<RecordingReader> open_recording(const fs::path& input) {
  std::error_code error;
  if (fs::is_directory(input, error)) return open_folder(input);
  auto reader = open_recording(FileBytes(input));
  const fs::path journal = input.string() + "-wal";
  if (!fs::exists(journal, error) || fs::file_size(journal, error) == 0) return reader;
  // SQLite's own tools merge it when they open the file for writing.
  std::vector<Damage> damages{
      {0, "the newest messages are in a journal beside the file, which is not read: open it once with sqlite3", journal.string()}};
  std::vector<std::unique_ptr<RecordingReader>> parts;
  parts.push_back(std::move(reader));
  return std::make_unique<JoinedReader>(input.string(), std::move(parts), std::move(damages));
}

std::unique_ptr<RecordingReader> open_recordings(const std::vector<fs::path>& inputs) {
  if (inputs.size() == 1) return open_recording(inputs.front());
  std::vector<std::unique_ptr<RecordingReader>> parts;
  std::string name;
  for (const fs::path& input : inputs) {
    parts.push_back(open_recording(input));
    name += (name.empty() ? "" : " + ") + input.string();
  }
  return std::make_unique<JoinedReader>(name, std::move(parts), std::vector<Damage>{});
}

}  // namespace kilvo::lab
