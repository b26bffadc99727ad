#include "apps/cli/output_folder.hpp"

#include <cerrno>
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <system_error>

#include "apps/cli/csv_file.hpp"
#include "lab/mapping/output_error.hpp"

namespace kilvo::cli {

namespace fs = std::filesystem;

void write_text_file(const fs::path& path, std::string_view text) {
  CsvFile file(path, text);
  file.close();
}

void prepare_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw lab::OutputError(fmt::format("{}: cannot be created: {}", folder.string(), error.message()));
  if (!fs::is_directory(folder, error)) throw lab::OutputError(fmt::format("{}: is not a folder", folder.string()));
  const fs::path probe = folder / ".kilvo_can_write_here";
  write_text_file(probe, "");
  fs::remove(probe, error);
}

void claim_folder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // Some file systems have no locks: there two programs do not notice each other.
  if (descriptor >= 0 && flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw lab::OutputError(fmt::format("{}: another kilvo is writing into it", folder.string()));
}

void remove_results(const fs::path& folder) {
  std::error_code ignored;
  for (const char* name : {"odometry.tum", "odometry_smooth.tum", "sweeps.tum", "states.csv", "contacts.csv", "degradation.csv", "run.mcap",
                           "modality.csv", "timing.csv", "events.csv", "skeleton.csv", "map.ply", "summary.json", "report.html"}) {
    if (fs::is_regular_file(folder / name, ignored)) fs::remove(folder / name, ignored);
  }
}

}  // namespace kilvo::cli
