// How the program ends.
#pragma once

#include <stdexcept>

namespace kilvo::cli {

enum ExitCode : int {
  done = 0,
  run_failed = 1,      // what was good is written, and the summary says why
  wrong_usage = 2,     // usage, configuration, or an output that cannot be written
  unusable_input = 3,  // missing, not this format, a wanted sensor without a topic, clouds without point times
};

/// A command line that makes no sense; the text says what would.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace kilvo::cli
