// kilvo: the command line program.
#include <algorithm>
#include <fmt/core.h>
#include <new>
#include <string_view>

#include "apps/cli/arguments.hpp"
#include "apps/cli/exit_code.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/evaluation/align.hpp"
#include "lab/evaluation/csv_reader.hpp"
#include "lab/evaluation/trajectory_file.hpp"
#include "lab/mapping/output_error.hpp"
#include "lab/messages/input_error.hpp"
#include "lab/report/report.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::cli {
namespace {

// "run: " when that is the verb whose words are wrong.
std::string where(const CLI::App& program) {
  const auto verbs = program.get_subcommands();
  return verbs.empty() ? "" : verbs.front()->get_name() + ": ";
}

int parse_and_do(const std::vector<std::string>& words) {
  CLI::App program("Odometry and a map for humanoid robots, from their legs, inertial unit, LiDAR and camera.", "kilvo");
  program.set_help_flag("--help,-h", "this text, or that of a verb");
  program.set_version_flag("--version", "kilvo " KILVO_VERSION, "the program's version");
  program.require_subcommand(0, 1);
  program.get_formatter()->label("SUBCOMMAND", "VERB");
  Action chosen;
  add_run(program, chosen);
  add_live(program, chosen);
  add_info(program, chosen);
  add_doctor(program, chosen);
  add_calibrate(program, chosen);
  add_eval(program, chosen);
  add_compare(program, chosen);
  add_eval_contacts(program, chosen);
  add_report(program, chosen);
  add_config(program, chosen);
  add_convert(program, chosen);
  add_simulate(program, chosen);
  add_demo(program, chosen);
  for (CLI::App* verb : program.get_subcommands({})) verb->group("Verbs");
  program.footer(
      "Each verb has its own: kilvo VERB --help\nExit codes: 0 done, 1 the run failed, 2 wrong usage or configuration, 3 unusable input");
  check_arguments(words, program);
  try {
    std::vector<std::string> reversed = with_values(words);
    std::ranges::reverse(reversed);
    program.parse(reversed);
  } catch (const CLI::Success& asked) {  // --help, --version
    return program.exit(asked);
  } catch (const CLI::ParseError& error) {
    throw UsageError(where(program) + error.what());
  }
  if (!chosen) {
    fmt::print(stderr, "{}", program.help());
    throw UsageError("nothing to do: name a verb");
  }
  return chosen();
}

int fail(ExitCode code, std::string_view why) {
  // One line, whatever a library put into its message.
  std::string line(why);
  for (char& c : line) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  fmt::print(stderr, "kilvo: error: {}\n", line);
  return code;
}

// Of a configuration all mistakes are told, a line each.
int fail_lines(ExitCode code, std::string_view why) {
  for (std::size_t begin = 0; begin <= why.size();) {
    const std::size_t end = std::min(why.find('\n', begin), why.size());
    fail(code, why.substr(begin, end - begin));
    begin = end + 1;
  }
  return code;
}

int run_program(const std::vector<std::string>& words) {
  try {
    return parse_and_do(words);
  } catch (const UsageError& e) {
    return fail(wrong_usage, e.what());
  } catch (const lab::ConfigError& e) {
    return fail_lines(wrong_usage, e.what());
  } catch (const lab::OutputError& e) {
    return fail(wrong_usage, e.what());
  } catch (const lab::TrajectoryOutputError& e) {
    return fail(wrong_usage, e.what());
  } catch (const lab::InputError& e) {
    return fail(unusable_input, e.what());
  } catch (const lab::TrajectoryError& e) {
    return fail(unusable_input, e.what());
  } catch (const lab::EvaluationError& e) {
    return fail(unusable_input, e.what());
  } catch (const lab::CsvError& e) {
    return fail(unusable_input, e.what());
  } catch (const lab::ReportError& e) {
    return fail(unusable_input, e.what());
  } catch (const std::bad_alloc&) {
    return fail(run_failed, "out of memory");
  } catch (const std::exception& e) {
    return fail(run_failed, e.what());
  }
}

}  // namespace
}  // namespace kilvo::cli

int main(int argc, char** argv) { return kilvo::cli::run_program({argv + 1, argv + argc}); }
