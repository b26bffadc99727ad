// Where the configurations that come with the program are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace kilvo::cli {

/// The file that `--config` means, or config/robots/g1.yaml when it is not given. Throws UsageError when the latter is nowhere.
std::filesystem::path config_file(const std::optional<std::string>& wanted);

}  // namespace kilvo::cli
