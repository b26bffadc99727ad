// What stands about where robots walk, and is no plane.
#pragma once

#include "lab/simulation/walk.hpp"
#include "lab/simulation/world.hpp"

namespace kilvo::lab {

/// The scene with so many things more, beside the way of the walk: heaps of leaves, turned cartons, rods. Fewer where there is no room.
Scene cluttered(Scene scene, const Walk& walk, int objects, std::uint64_t seed);

}  // namespace kilvo::lab
