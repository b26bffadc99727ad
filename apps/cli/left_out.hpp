// Which senses a run goes without once the data have shown that their description is wrong.
#pragma once

#include <vector>

#include "lab/doctor/description_watch.hpp"

namespace kilvo::cli {

/// The first findings with which results are worthless, all of one judgement; empty: there are none. Does not depend on how fast it was
/// judged.
std::vector<lab::WrongDescription> first_spoiling(const std::vector<lab::WrongDescription>& found);

/// `used` without the senses that these findings spoil. A mount of the IMU on the robot concerns the legs alone; images need the LiDAR's
/// map. Empty: nothing is left to estimate with.
std::vector<Sensor> without_spoiled(const std::vector<Sensor>& used, const std::vector<lab::WrongDescription>& found);

}  // namespace kilvo::cli
