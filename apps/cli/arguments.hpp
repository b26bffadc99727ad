// Mistyped verbs and options, found before CLI11 sees them, so that the nearest valid one can be named.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace kilvo::cli {

/// Options that were given without the value that they may have, with it.
std::vector<std::string> with_values(std::vector<std::string> words);

/// Throws UsageError at the first word that is no verb or no option of its verb.
void check_arguments(const std::vector<std::string>& words, const CLI::App& program);

}  // namespace kilvo::cli
