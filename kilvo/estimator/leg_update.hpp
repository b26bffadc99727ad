// One leg sample on a state: contacts, stances, update.
#pragma once

#include <array>

#include "kilvo/estimator/replay.hpp"
#include "kilvo/legs/contact_detector.hpp"
#include "kilvo/legs/stance_tracker.hpp"
#include "kilvo/map/voxel_map.hpp"

namespace kilvo {

/// What a leg sample did.
struct LegUpdate {
  LegStep step;
  std::array<bool, 2> passed = {false, false};  // the feet whose rows were used
  double contact_us = 0;                        // the contacts' part of the time
};

/// `e`: predicted to feet.t. `replay`: holds the IMU samples, and gets the step. `map`: on whose planes the feet stand, if any.
LegUpdate update_by_legs(const Feet& feet, Estimate& e, ContactDetector& contacts, StanceTracker& stances, Replay& replay,
                         const VoxelMap* map, StanceTracker::Ground ground);

}  // namespace kilvo
