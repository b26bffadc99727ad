// Whether the legs step. What they say of mounts, clocks, names and lengths is what soles that stand in turn say: a robot that lies, sits,
// hangs or gets up moves its legs as well, and none of that holds.
#pragma once

#include <vector>

#include "lab/doctor/leg_path.hpp"

namespace kilvo::lab {

struct Stepping {
  int steps = 0;              // times that the one foot passed the other
  double begin = 0, end = 0;  // s, of the first step and of the last time
  bool walks() const { return steps >= fewest; }
  /// The soles bear the robot then: it walks, or is about to.
  bool bears(double t) const { return walks() && t > begin - stands_before && t < end + stands_before; }
  double seconds() const { return walks() ? end - begin : 0; }

 private:
  static constexpr int fewest = 4;              // steps: two with each foot
  static constexpr double stands_before = 1.5;  // s: a robot stands before it walks
};

/// Under any description of the legs: signs, names and lengths that are wrong do not change how often the feet pass each other.
Stepping stepping_of(const std::vector<LegPose>& path);

}  // namespace kilvo::lab
