// The verbs of the `kilvo` program, one file each. A verb declares its options and, when it is the one on the command line, leaves what
// is to be done in `chosen`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "lab/evaluation/align.hpp"

namespace kilvo::cli {

/// Returns the exit code.
using Action = std::function<int()>;

void add_run(CLI::App& program, Action& chosen);
void add_doctor(CLI::App& program, Action& chosen);
void add_calibrate(CLI::App& program, Action& chosen);
void add_info(CLI::App& program, Action& chosen);
void add_eval(CLI::App& program, Action& chosen);
void add_compare(CLI::App& program, Action& chosen);
void add_eval_contacts(CLI::App& program, Action& chosen);
void add_report(CLI::App& program, Action& chosen);
void add_convert(CLI::App& program, Action& chosen);
void add_config(CLI::App& program, Action& chosen);
void add_demo(CLI::App& program, Action& chosen);
void add_live(CLI::App& program, Action& chosen);
void add_simulate(CLI::App& program, Action& chosen);

/// The alignment of that name. Throws UsageError that names the nearest.
lab::Alignment alignment_or_refuse(const std::string& name);

}  // namespace kilvo::cli
