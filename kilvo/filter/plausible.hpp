// Whether an estimate can be that of a walking robot at all.
#pragma once

#include "kilvo/filter/state.hpp"

namespace kilvo {

/// Finite, at a speed that a walking machine may have, with variances that are none of a state that has lost itself.
bool is_plausible(const Estimate& e);

/// Whether a covariance has no negative direction, but for rounding: what is known exactly, and feet that do not stand, have no variance.
bool is_definite(const Covariance& P);

}  // namespace kilvo
