#include "lab/recordings/recording_file.hpp"

#include <array>

#include "lab/messages/input_error.hpp"

namespace kilvo::lab {
namespace {

std::filesystem::path bag_in(const std::filesystem::path& folder) {
  auto bag = folder / "recording.bag";
  std::error_code error;
  if (std::filesystem::exists(bag, error)) return bag;
  if (std::filesystem::exists(folder / "metadata.yaml", error)) {
    throw InputError(folder.string() + ": a ROS 2 recording is recognised, but not read yet (convert it with rosbags-convert)");
  }
  throw InputError(folder.string() + ": the folder has no recording.bag");
}

void refuse_other_formats(const FileBytes& file) {
  using namespace std::string_view_literals;
  std::array<std::uint8_t, 16> begin{};
  const std::string_view text = as_text(Bytes(begin).first(file.read_at(0, begin)));
  const char* kind = nullptr;
  if (text.starts_with("\x89MCAP0\r\n"sv)) kind = "MCAP";
  if (text.starts_with("SQLite format 3\0"sv)) kind = "ROS 2 sqlite (.db3)";
  if (kind != nullptr)
    throw InputError(file.name() + ": a " + kind + " recording is recognised, but not read yet (convert it with rosbags-convert)");
}

}  // namespace

Rosbag1Reader open_recording(const std::filesystem::path& input) {
  std::error_code error;
  FileBytes file(std::filesystem::is_directory(input, error) ? bag_in(input) : input);
  refuse_other_formats(file);
  return Rosbag1Reader(std::move(file));
}

}  // namespace kilvo::lab
