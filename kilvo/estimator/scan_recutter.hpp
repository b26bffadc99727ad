// Scans cut anew so that each ends at an image, as in the paper (Section IV-D), for comparison. Ours uses both as they are.
#pragma once

#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

class ScanRecutter {
 public:
  /// `longest`: without an image, what has come in so long is a scan.
  explicit ScanRecutter(Duration longest) : longest_(longest) {}

  /// Each in the order of time.
  void add_image(Time t) { cuts_.push_back(t); }
  /// The scans that are complete with this one.
  std::vector<LidarScan> add(const LidarScan& scan);

 private:
  Duration longest_;
  std::vector<Time> cuts_;  // images that no scan has ended at
  LidarScan rest_;
};

}  // namespace kilvo
