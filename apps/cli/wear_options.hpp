// The options of `kilvo simulate` that make its robot less than ideal.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <optional>

#include "lab/simulation/simulator_config.hpp"

namespace kilvo::cli {

/// What was given on the command line, in the order of the table in wear_options.cpp and in the units of the options.
struct WearOptions {
  std::array<std::optional<double>, 14> given;
};

void add_wear_options(CLI::App& verb, WearOptions& options);

/// The given ones replace those of the configuration.
void apply(const WearOptions& options, lab::SimulatorConfig& config);

}  // namespace kilvo::cli
