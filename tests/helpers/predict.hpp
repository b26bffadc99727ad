// The estimate at the end of an IMU interval.
#pragma once

#include "kilvo/filter/predict.hpp"

namespace kilvo::test {

inline Estimate predict(Estimate e, const ImuInterval& interval, const StandingFeet& feet, const ProcessNoise& noise) {
  carry(e, interval, feet, noise);
  return e;
}

}  // namespace kilvo::test
