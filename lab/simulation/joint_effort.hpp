// What the joints must do to carry the robot: a static load, enough to tell a loaded leg from a free one.
#pragma once

#include "lab/simulation/walk.hpp"

namespace kilvo::lab {

/// The part of the ground's force that each foot bears (left, right): 0 in the air, growing within `ramp` seconds after touchdown and
/// falling as long before lift-off; together 1 while either foot stands.
std::array<double, 2> load_shares(const Walk& walk, double t, double ramp = 0.06);

/// Torques in the order of joint_names(), N m, of a robot of `mass` kg whose weight and vertical acceleration are borne in the middle of
/// the standing soles. The legs' own weight and the waist are left out.
JointAngles joint_efforts(const Walk& walk, double t, double mass);

}  // namespace kilvo::lab
