#include "apps/cli/shipped_config.hpp"

#include <fmt/core.h>

#include "apps/cli/exit_code.hpp"

namespace kilvo::cli {

namespace fs = std::filesystem;

fs::path config_file(const std::optional<std::string>& wanted) {
  if (wanted) return *wanted;
  // Beside the program as installed; the path of the sources only helps a program that was built and never installed.
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share/kilvo/config";
  for (const fs::path& folder : {installed, fs::path(KILVO_SOURCE_CONFIG)}) {
    const fs::path file = folder / "robots/g1.yaml";
    if (fs::exists(file, error)) return file;
  }
  throw UsageError(fmt::format("no default configuration in {}: name one with --config", installed.string()));
}

}  // namespace kilvo::cli
