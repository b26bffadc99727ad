// An input that cannot be used at all: missing, not this format, a wanted sensor without a topic, clouds without point times.
#pragma once

#include <stdexcept>

namespace kilvo::lab {

/// The text names the file or topic and what to do about it. The command line ends with exit code 3.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace kilvo::lab
