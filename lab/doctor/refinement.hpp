// What a recording says about a value of the description more exactly than the description does.
#pragma once

#include <string>
#include <vector>

#include "lab/doctor/finding.hpp"

namespace kilvo::lab {

struct Refinement {
  Sensor sensor = Sensor::imu;
  std::string what;            // "rotation of the LiDAR on the IMU"
  std::vector<double> change;  // measured less described, by component, in `unit`
  std::vector<double> sigma;   // standard deviations, with what the method itself is off by
  std::string unit;            // deg, m, s, or - for a factor
  /// The part of `change` that is to be made: the posterior mean, component by component, when what descriptions of this kind are off by
  /// has the variance that `change` itself shows beyond `sigma` (empirical Bayes), and no more than that component shows by itself. Nothing
  /// when `change` is no larger than chance makes it. Of the LiDAR's position: see expected_shift.
  std::vector<double> taken;
  bool observable = true;       // false: the motion showed nothing of it
  bool significant = false;     // some component is more than 3 standard deviations off
  std::string advice;           // what motion would help
  std::vector<Change> changes;  // that make what is `taken`
  bool is_taken() const;
  Eigen::Vector3d taken_vector() const { return {taken[0], taken[1], taken[2]}; }
};

/// A component whose standard deviation exceeds `largest_sigma` is not observable, and kept.
Refinement refinement(Sensor sensor, const std::string& what, std::vector<double> change, std::vector<double> sigma, double method,
                      double largest_sigma, const std::string& unit);

/// One line for each: change, standard deviation, and what is done.
std::string to_text(const std::vector<Refinement>& refinements);
std::string to_json(const std::vector<Refinement>& refinements);

}  // namespace kilvo::lab
