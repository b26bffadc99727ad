// A result that cannot be written.
#pragma once

#include <stdexcept>

namespace kilvo::lab {

/// The message names the path and says why. A program that sees it ends with exit code 2.
class OutputError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace kilvo::lab
