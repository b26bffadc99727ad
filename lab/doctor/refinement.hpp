// What a recording says about a value of the description more exactly than the description does.
#pragma once

#include <string>
#include <vector>

#include "lab/doctor/finding.hpp"

namespace kilvo::lab {

struct Refinement {
  Sensor sensor = Sensor::imu;
  std::string what;             // "rotation of the LiDAR on the IMU"
  std::vector<double> change;   // measured less described, by component, in `unit`
  std::vector<double> sigma;    // standard deviations, with what the method itself is off by
  std::string unit;             // deg, m, s, or - for a factor
  bool observable = true;       // false: the motion did not show it
  bool significant = false;     // some component is more than 3 standard deviations off
  std::string advice;           // what motion would help
  std::vector<Change> changes;  // to be made when it is significant
};

/// A component of which so much is not known is not observable.
Refinement refinement(Sensor sensor, const std::string& what, std::vector<double> change, std::vector<double> sigma, double method,
                      double largest_sigma, const std::string& unit);

/// One line for each: change, standard deviation, and what is done.
std::string to_text(const std::vector<Refinement>& refinements);
std::string to_json(const std::vector<Refinement>& refinements);

}  // namespace kilvo::lab
