// Settings of the calibration that a run does by itself.
#pragma once

#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo::lab {

struct CalibrationConfig {
  bool online = false;

  static constexpr auto fields() {
    return std::tuple{Field{"online", &CalibrationConfig::online, "-",
                            "kilvo run: what the first minute of the recording says of mounts, focal length and clocks, as by kilvo "
                            "calibrate, is used from the start and reported"}};
  }
};

}  // namespace kilvo::lab
