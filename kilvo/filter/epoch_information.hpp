// What measurements against one epoch of the map know about the pose.
#pragma once

#include <cstdint>

#include "kilvo/filter/state.hpp"

namespace kilvo {

struct EpochInformation {
  std::uint32_t epoch = 0;                    // VoxelMap::insert
  PoseCovariance A = PoseCovariance::Zero();  // information on (rotation, position)
};

}  // namespace kilvo
