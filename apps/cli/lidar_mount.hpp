// Where the LiDAR sits on the IMU, by the innovations of a run on these two alone.
#pragma once

#include <vector>

#include "kilvo/sensors/measurement_source.hpp"
#include "lab/doctor/refinement.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::cli {

/// Whether there is a position of the LiDAR that can be measured by sweeps as the source will give them.
bool can_refine_lidar_position(const std::vector<lab::Refinement>& refined, bool without_deskew);

/// Of what is `refined`, the position of the LiDAR becomes what `seconds` of the source say against these settings. It is left as it is
/// where they say nothing. `first`: the rotation of the LiDAR on the IMU as it was described, before it was found to be another one.
void refine_lidar_position(std::vector<lab::Refinement>& refined, const SO3& first, lab::Settings settings, MeasurementSource& source,
                           double seconds);

}  // namespace kilvo::cli
