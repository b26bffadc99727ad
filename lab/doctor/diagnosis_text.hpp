// A diagnosis for a person, and for a program.
#pragma once

#include <string>

#include "lab/doctor/finding.hpp"

namespace kilvo::lab {

std::string to_text(const Diagnosis& diagnosis);
std::string to_json(const Diagnosis& diagnosis);

}  // namespace kilvo::lab
