// What kilvo calibrate measured, as a page for people: each value before and after, in its standard deviations.
#pragma once

#include <string>
#include <vector>

#include "lab/doctor/refinement.hpp"

namespace kilvo::lab {

struct Calibration {
  std::string recording, config;   // as they were named
  std::vector<Finding> mended;     // first, because they were too large to be refined
  std::vector<Refinement> before;  // of the description, with those mended
  std::vector<Refinement> after;   // of the one that is written
};

/// One HTML page that needs nothing else.
std::string to_html(const Calibration& calibration);

}  // namespace kilvo::lab
