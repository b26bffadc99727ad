#include "apps/cli/shipped_config.hpp"

#include <fmt/core.h>

#include "apps/cli/exit_code.hpp"

namespace kilvo::cli {

namespace fs = std::filesystem;

fs::path config_file(const std::optional<std::string>& wanted, const std::string& input) {
  if (wanted) return *wanted;
  std::error_code error;
  // A folder of `kilvo simulate`, or the recording in it.
  const fs::path simulated = fs::path(input).filename() == "recording.bag" ? fs::path(input).parent_path() : fs::path(input);
  if (fs::path own = simulated / "config.yaml"; !input.empty() && fs::is_regular_file(own, error)) return own;
  // Beside the program as installed; the path of the sources only helps a program that was built and never installed.
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share/kilvo/config";
  for (const fs::path& folder : {installed, fs::path(KILVO_SOURCE_CONFIG)}) {
    fs::path file = folder / "robots/g1.yaml";
    if (fs::exists(file, error)) return file;
  }
  throw UsageError(fmt::format("no default configuration in {}: name one with --config", installed.string()));
}

}  // namespace kilvo::cli
