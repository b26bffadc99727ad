// Where the configurations that come with the program are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace kilvo::cli {

/// The file that `--config` means. When it is not given: config.yaml in an input that is a folder (simulations bring their own), else
/// robots/g1.yaml. Throws UsageError when that is nowhere.
std::filesystem::path config_file(const std::optional<std::string>& wanted, const std::string& input = {});

}  // namespace kilvo::cli
