// What no sensor measures.
#pragma once

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// What is wrong with a measurement by itself; nullptr: nothing.
const char* fault_of(const ImuSample& s);
const char* fault_of(const JointSample& s);
const char* fault_of(const LidarScan& s);
const char* fault_of(const CameraImage& s);
inline const char* fault_of(const Measurement& m) {
  return std::visit([](const auto& s) { return fault_of(s); }, m);
}

}  // namespace kilvo
